#include "app/measure/diagnosis/linear_problem.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "app/measure/diagnosis/block_columns.h"
#include "app/measure/diagnosis/carried_columns.h"
#include "app/measure/diagnosis/shape_search.h"

namespace plumbline::measure {

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
    : fit_(std::move(fit)),
      linear_(std::move(linear_at)),
      aligned_(model),
      whitener_(fit_),
      layout_(fit_.layout()) {
  aligned_.effects.clear();
  const Linearisation& linear = *linear_;
  const Dataset& data = fit_.data;
  joint_span_ = JointSpans(data, fit_.rows);
  response_.resize(layout_.total());
  std::set<ClusterIndex> clusters;
  for (const FitRowIndex j : fit_.rows.indices()) {
    const RowIndex row = fit_.rows[j];
    const double weight = fit_.weights[row];
    freedom_ += weight * layout_.count(j);
    if (weight > 0.5 && layout_.count(j) > 0) clusters.insert(data.cluster_of[row]);
    const LinearRow& at = linear.rows[row];
    effects::Influence<double> influence;
    effects::AddEffects(model.effects, data.conditions[row], influence);
    RowResidual y = at.residual;
    for (int entry = 0; entry < effects::Influence<double>::kSize; ++entry) {
      if (influence[entry] != 0) y += influence[entry] * linear.gradients[row].col(entry);
    }
    whitener_[j].Apply(y, layout_.PartOf(response_, j));
  }
  clusters_ = std::max<int>(2, static_cast<int>(clusters.size()));

  const FitRowIndex after_rows(fit_.rows.count());
  equations_ = layout_.count(after_rows);
  freedom_ += equations_;
  if (equations_ > 0) {
    const std::vector<Equation> equations = Nuisances(data).EquationsAt(model);
    for (int k = 0; k < equations_; ++k) {
      response_[layout_.first(after_rows) + k] = equations[k].residual;
    }
  }
  nuisances_ = std::make_unique<NuisanceProjection>(fit_, linear, model, whitener_, layout_);
  freedom_ -= static_cast<double>(nuisances_->rank());
  nuisances_->Project(response_);
}

Eigen::MatrixXd LinearProblem::Columns(const Block& block, bool projected) const {
  const ShapeSearch* const search = block.empirical() ? nullptr : ShapeSearchOf(*block.term.effect);
  if (search != nullptr) {
    if (std::optional<Eigen::MatrixXd> carried = search->Columns(*this, block)) {
      if (projected) Project(*carried);
      return *std::move(carried);
    }
  }
  const int width = block.columns.count();
  Eigen::MatrixXd columns(layout_.total(), width);
  columns.bottomRows(equations_).setZero();  // no effect acts on what is known beside the rows
  if (!block.empirical() && search == nullptr) {
    const auto kept = linear_->columns->Of(fit_.data, *linear_, block, fit_.threads);
    for (const FitRowIndex j : fit_.rows.indices()) {
      whitener_[j].Apply(linear_->layout.PartOf(*kept, fit_.rows[j]), layout_.PartOf(columns, j));
    }
    if (projected) Project(columns);
    return columns;
  }
  InParallel(fit_.rows.count(), fit_.threads, [&](int first, int last) {
    Eigen::MatrixXd at;
    for (const FitRowIndex j : IndexRange(FitRowIndex(first), FitRowIndex(last))) {
      at.resize(layout_.count(j), width);
      ColumnsAt(fit_.data, *linear_, block, fit_.rows[j], at);
      whitener_[j].Apply(at, layout_.PartOf(columns, j));
    }
  });
  if (projected) Project(columns);
  return columns;
}

void LinearProblem::Project(Eigen::Ref<Eigen::MatrixXd> columns) const {
  nuisances_->Project(columns);
}

const void* LinearProblem::KeptAs(
    const KeptKey& key, const std::function<std::shared_ptr<const void>()>& compute) const {
  {
    const std::lock_guard lock(mutex_);
    const auto known = kept_.find(key);
    if (known != kept_.end()) return known->second.get();
  }
  // Without the lock: what is kept may be computed from something else that is kept.
  std::shared_ptr<const void> computed = compute();
  const std::lock_guard lock(mutex_);
  return kept_.emplace(key, std::move(computed)).first->second.get();
}

const Eigen::VectorXd& LinearProblem::Carrier(int entry) const {
  return Kept<Eigen::VectorXd>(entry, [&] {
    Eigen::VectorXd carrier = Eigen::VectorXd::Zero(layout_.total());
    for (const FitRowIndex j : fit_.rows.indices()) {
      const Gradient& gradient = linear_->gradients[fit_.rows[j]];
      whitener_[j].Apply(gradient.col(entry), layout_.PartOf(carrier, j));
    }
    return carrier;
  });
}

const CarriedColumns& LinearProblem::CarriedBy(const std::vector<int>& entries) const {
  return *static_cast<const CarriedColumns*>(KeptAs({typeid(CarriedColumns), entries}, [&] {
    return std::make_shared<const CarriedColumns>(*this, entries);
  }));
}

Eigen::MatrixXd LinearProblem::Carried(const std::vector<int>& entries,
                                       const Eigen::MatrixXd& factors) const {
  const auto wide = static_cast<int>(entries.size());
  Eigen::MatrixXd columns(response_.size(), wide * factors.cols());
  columns.bottomRows(equations_).setZero();
  for (int k = 0; k < factors.cols(); ++k) {
    for (int a = 0; a < wide; ++a) {
      const Eigen::VectorXd& carrier = Carrier(entries[a]);
      auto column = columns.col(k * wide + a);
      for (const FitRowIndex j : fit_.rows.indices()) {
        layout_.PartOf(column, j) = factors(j.value(), k) * layout_.PartOf(carrier, j);
      }
    }
  }
  return columns;
}

}  // namespace plumbline::measure
