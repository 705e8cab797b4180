#include "app/diagnosis/linear_problem.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <set>

#include "app/diagnosis/block_columns.h"
#include "app/diagnosis/shape_search.h"

namespace plumbline {

namespace {

std::vector<double> JointSpans(const Dataset& data, const FitRows& rows) {
  std::vector<double> spans;
  for (int joint = 0; joint < data.cell.robot.size(); ++joint) {
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (const RowIndex row : rows) {
      const double q = data.measured(row).q[joint];
      low = std::min(low, q);
      high = std::max(high, q);
    }
    spans.push_back(rows.empty() ? 0 : high - low);
  }
  return spans;
}

}  // namespace

LinearProblem::LinearProblem(FitProblem fit, std::shared_ptr<const Linearisation> linear_at,
                             const Model& model)
    : fit_(std::move(fit)), linear_(std::move(linear_at)) {
  const Linearisation& linear = *linear_;
  const Dataset& data = fit_.data;
  const int axes = linear.axes;
  const int count = fit_.rows.count();
  joint_span_ = JointSpans(data, fit_.rows);
  response_.resize(count * axes);
  std::set<ClusterIndex> clusters;
  for (const FitRowIndex j : fit_.rows.indices()) {
    const RowIndex row = fit_.rows[j];
    const double weight = fit_.weights[row];
    scale_.push_back(std::sqrt(weight) / fit_.sigma_m);
    freedom_ += weight * axes;
    if (weight > 0.5) clusters.insert(data.cluster_of[row]);
    const LinearRow& at = linear.rows[row];
    Influence<double> influence;
    AddEffects(model.effects, data.conditions[row], influence);
    Vec3 y = at.residual;
    for (int entry = 0; entry < Influence<double>::kSize; ++entry) {
      if (influence[entry] != 0) y += influence[entry] * linear.gradients[row].col(entry);
    }
    response_.segment(j.value() * axes, axes) = scale_[j] * y.head(axes);
  }
  clusters_ = std::max<int>(2, static_cast<int>(clusters.size()));

  const int per_session = (data.frames_free() ? 6 : 0) + (data.tip_free() ? 3 : 0);
  if (per_session > 0) {
    Eigen::MatrixXd frames =
        Eigen::MatrixXd::Zero(count * axes, per_session * data.sessions_count());
    for (const FitRowIndex j : fit_.rows.indices()) {
      const RowIndex row = fit_.rows[j];
      const int first = per_session * data.session_of[row].value();
      const auto& derivative = linear.rows[row].frames;
      auto block = frames.block(j.value() * axes, first, axes, per_session);
      if (data.frames_free()) block.leftCols(6) = scale_[j] * derivative.topLeftCorner(axes, 6);
      if (data.tip_free()) block.rightCols(3) = scale_[j] * derivative.topRightCorner(axes, 3);
    }
    Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(frames);
    qr.setThreshold(1e-9);
    const auto rank = qr.rank();
    frames_ = qr.householderQ() * Eigen::MatrixXd::Identity(frames.rows(), rank);
    freedom_ -= static_cast<double>(rank);
    response_ -= frames_ * (frames_.transpose() * response_);
  }
}

Eigen::MatrixXd LinearProblem::Columns(const Block& block, bool projected) const {
  const int axes = linear_->axes;
  const int count = fit_.rows.count(), width = block.columns.count();
  Eigen::MatrixXd columns(count * axes, width);
  if (!block.empirical() && ShapeSearchOf(*block.term.effect) == nullptr) {
    const auto kept = linear_->columns->Of(fit_.data, *linear_, block, fit_.threads);
    for (const FitRowIndex j : fit_.rows.indices()) {
      columns.middleRows(j.value() * axes, axes) =
          scale_[j] * kept->middleRows(3 * fit_.rows[j].value(), axes);
    }
    if (projected) Project(columns);
    return columns;
  }
  InParallel(count, fit_.threads, [&](int first, int last) {
    Eigen::MatrixXd at(3, width);
    for (const FitRowIndex j : IndexRange(FitRowIndex(first), FitRowIndex(last))) {
      ColumnsAt(fit_.data, *linear_, block, fit_.rows[j], at);
      columns.middleRows(j.value() * axes, axes) = scale_[j] * at.topRows(axes);
    }
  });
  if (projected) Project(columns);
  return columns;
}

void LinearProblem::Project(Eigen::Ref<Eigen::MatrixXd> columns) const {
  if (frames_.cols() > 0) columns -= frames_ * (frames_.transpose() * columns).eval();
}

const Eigen::VectorXd& LinearProblem::Carrier(int entry) const {
  Eigen::VectorXd& carrier = carriers_[entry];
  if (carrier.size() == 0) {
    const int axes = linear_->axes;
    carrier.resize(fit_.rows.count() * axes);
    for (const FitRowIndex j : fit_.rows.indices()) {
      const Gradient& gradient = linear_->gradients[fit_.rows[j]];
      carrier.segment(j.value() * axes, axes) = scale_[j] * gradient.col(entry).head(axes);
    }
  }
  return carrier;
}

Eigen::MatrixXd LinearProblem::Carried(const std::vector<int>& entries,
                                       const Eigen::MatrixXd& factors) const {
  const int axes = linear_->axes;
  const auto wide = static_cast<int>(entries.size());
  Eigen::MatrixXd columns(response_.size(), wide * factors.cols());
  for (int k = 0; k < factors.cols(); ++k) {
    for (int a = 0; a < wide; ++a) {
      const Eigen::VectorXd& carrier = Carrier(entries[static_cast<std::size_t>(a)]);
      auto column = columns.col(k * wide + a);
      for (int j = 0; j < factors.rows(); ++j) {
        column.segment(j * axes, axes) = factors(j, k) * carrier.segment(j * axes, axes);
      }
    }
  }
  return columns;
}

}  // namespace plumbline
