#include "app/diagnosis/linear_problem.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <set>

#include "app/diagnosis/block_columns.h"
#include "app/diagnosis/shape_search.h"

namespace plumbline {

namespace {

std::vector<double> JointSpans(const Dataset& data, const std::vector<int>& rows) {
  std::vector<double> spans;
  for (int joint = 0; joint < data.cell.robot.size(); ++joint) {
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (const int row : rows) {
      const double q = data.table.rows[static_cast<std::size_t>(row)].q[joint];
      low = std::min(low, q);
      high = std::max(high, q);
    }
    spans.push_back(rows.empty() ? 0 : high - low);
  }
  return spans;
}

}  // namespace

LinearProblem::LinearProblem(const Dataset& data, std::shared_ptr<const Linearisation> linear_at,
                             const Model& model, std::vector<int> rows,
                             const std::vector<double>& weights, double sigma_m, int threads)
    : data_(data),
      linear_(std::move(linear_at)),
      rows_(std::move(rows)),
      sigma_m_(sigma_m),
      threads_(threads) {
  const Linearisation& linear = *linear_;
  const int axes = linear.axes;
  const auto count = static_cast<int>(rows_.size());
  joint_span_ = JointSpans(data, rows_);
  scale_.resize(count);
  response_.resize(count * axes);
  std::set<int> clusters;
  std::vector<int> sessions;
  for (int j = 0; j < count; ++j) {
    const auto row = static_cast<std::size_t>(rows_[static_cast<std::size_t>(j)]);
    scale_[j] = std::sqrt(weights[row]) / sigma_m;
    freedom_ += weights[row] * axes;
    if (weights[row] > 0.5) clusters.insert(data.cluster_of[row]);
    const LinearRow& at = linear.rows[row];
    Influence<double> influence;
    AddEffects(model.effects, data.conditions[row], influence);
    Vec3 y = at.residual;
    for (int entry = 0; entry < Influence<double>::kSize; ++entry) {
      if (influence[entry] != 0) y += influence[entry] * linear.gradients[row].col(entry);
    }
    response_.segment(j * axes, axes) = scale_[j] * y.head(axes);
  }
  clusters_ = std::max<int>(2, static_cast<int>(clusters.size()));

  const int per_session = (data.frames_free() ? 6 : 0) + (data.tip_free() ? 3 : 0);
  if (per_session > 0) {
    Eigen::MatrixXd frames =
        Eigen::MatrixXd::Zero(count * axes, per_session * data.sessions_count());
    for (int j = 0; j < count; ++j) {
      const auto row = static_cast<std::size_t>(rows_[static_cast<std::size_t>(j)]);
      const int first = per_session * data.session_of[row];
      const auto& derivative = linear.rows[row].frames;
      auto block = frames.block(j * axes, first, axes, per_session);
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
  const auto count = static_cast<int>(rows_.size());
  const auto width = static_cast<int>(block.columns.size());
  Eigen::MatrixXd columns(count * axes, width);
  if (!block.empirical() && ShapeSearchOf(*block.term.effect) == nullptr) {
    const auto kept = linear_->columns->Of(data_, *linear_, block, threads_);
    for (int j = 0; j < count; ++j) {
      columns.middleRows(j * axes, axes) =
          scale_[j] * kept->middleRows(3 * rows_[static_cast<std::size_t>(j)], axes);
    }
    if (projected) Project(columns);
    return columns;
  }
  InParallel(count, threads_, [&](int first, int last) {
    Eigen::MatrixXd at(3, width);
    for (int j = first; j < last; ++j) {
      ColumnsAt(data_, *linear_, block, rows_[static_cast<std::size_t>(j)], at);
      columns.middleRows(j * axes, axes) = scale_[j] * at.topRows(axes);
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
    carrier.resize(static_cast<int>(rows_.size()) * axes);
    for (int j = 0; j < static_cast<int>(rows_.size()); ++j) {
      const auto row = static_cast<std::size_t>(rows_[static_cast<std::size_t>(j)]);
      carrier.segment(j * axes, axes) = scale_[j] * linear_->gradients[row].col(entry).head(axes);
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
