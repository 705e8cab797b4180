#include "app/measure/diagnosis/linear/linear_problem.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <set>

#include "app/measure/diagnosis/data/thresholds.h"
#include "app/measure/diagnosis/linear/carried_columns.h"
#include "app/measure/diagnosis/linear/shape_search.h"

namespace plumbline::measure {
double RowCorrelation(const Dataset& data, const PerRow<RowResidual>& residuals,
                      const PerRow<double>& weights) {
  constexpr double kMost = 0.95;
  double product = 0, square = 0;
  double variance = 0;  // of `product` under independence
  for (RowIndex row(1); row.value() < data.rows(); ++row) {
    const RowIndex previous(row.value() - 1);
    if (data.session_of[row] != data.session_of[previous]) continue;
    if (data.cluster_of[row] == data.cluster_of[previous]) continue;
    if (std::min(weights[row], weights[previous]) < kOutlierWeight) continue;
    const int count = data.numbers[row].lengths();
    if (count == 0 || count != data.numbers[previous].lengths()) continue;
    const auto current = residuals[row].head(count), last = residuals[previous].head(count);
    product += current.dot(last);
    variance += current.dot(last) * current.dot(last);
    square += (current.squaredNorm() + last.squaredNorm()) / 2;
  }
  if (!(square > 0)) return 0;
  const double correlation = product / square;
  if (product < kCorrelatedSigmas * std::sqrt(variance)) return 0;
  return std::min(kMost, correlation);
}

double VarianceInflation(const LinearProblem& problem,
                         const Eigen::Ref<const Eigen::VectorXd>& column) {
  const double rho = problem.fit().row_correlation;
  const double length = column.squaredNorm();
  if (!(rho > 0) || !(length > 0)) return 1;
  const Dataset& data = problem.data();
  const FitLayout& layout = problem.layout();
  RowResidual weighted_sum;  // over previous rows of rho^distance x
  double cross = 0;
  std::optional<RowIndex> previous;
  for (const FitRowIndex fit_row : problem.rows().indices()) {
    const RowIndex row = problem.rows()[fit_row];
    const auto x = layout.PartOf(column, fit_row);
    if (x.size() == 0) continue;
    const bool continues = previous && data.session_of[row] == data.session_of[*previous] &&
                           weighted_sum.size() == x.size();
    if (continues) {
      weighted_sum *= std::pow(rho, row.value() - previous->value());
      cross += x.dot(weighted_sum);
      weighted_sum += x;
    } else {
      weighted_sum = x;
    }
    previous = row;
  }
  return std::max(1.0, 1 + 2 * cross / length);
}

namespace {

constexpr double kThreshold = 1e-9;  // of the largest column; a smaller remainder is undetermined

/// Orthonormal basis of columns whose lengths were up to `scale` before other columns were
/// projected out of them.
Eigen::MatrixXd OrthonormalBasis(const Eigen::MatrixXd& columns, double scale) {
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(columns);
  if (!(qr.maxPivot() > kThreshold * scale)) return Eigen::MatrixXd(columns.rows(), 0);
  qr.setThreshold(kThreshold * scale / qr.maxPivot());
  return qr.householderQ() * Eigen::MatrixXd::Identity(columns.rows(), qr.rank());
}

double LargestColumn(const Eigen::MatrixXd& columns) {
  return columns.size() == 0 ? 0 : std::sqrt(columns.colwise().squaredNorm().maxCoeff());
}

}  // namespace

NuisanceProjection::NuisanceProjection(const FitProblem& fit, const Linearisation& linear,
                                       const Model& model, const Whitener& whitener,
                                       const FitLayout& layout)
    : nuisances_(fit.data) {
  std::vector<std::vector<FitRowIndex>> of_component(
      static_cast<std::size_t>(nuisances_.components()));
  for (const FitRowIndex j : fit.rows.indices()) {
    const auto group = nuisances_.GroupOf(fit.rows[j]);
    if (group) of_component[nuisances_.ComponentOf(*group).offset()].push_back(j);
  }
  int equation = layout.first(FitRowIndex(fit.rows.count()));
  for (std::size_t c = 0; c < of_component.size(); ++c) {
    AddPart(fit, linear, model, whitener, layout, ComponentIndex(c), of_component[c], equation);
  }
  frames_ = FrameColumns(fit, linear, whitener, layout);
  if (frames_.cols() == 0) return;
  const double scale = LargestColumn(frames_);
  ProjectParts(frames_);
  frames_ = OrthonormalBasis(frames_, scale);
}

Eigen::Index NuisanceProjection::rank() const {
  Eigen::Index rank = frames_.cols();
  for (const Part& part : parts_) rank += part.basis.cols();
  return rank;
}

double NuisanceProjection::Leverage(int residual) const {
  double leverage = frames_.cols() > 0 ? frames_.row(residual).squaredNorm() : 0;
  for (const Part& part : parts_) {
    const auto found = std::ranges::find(part.residuals, residual);
    if (found == part.residuals.end()) continue;
    leverage += part.basis.row(found - part.residuals.begin()).squaredNorm();
  }
  return leverage;
}

Eigen::MatrixXd NuisanceProjection::FrameColumns(const FitProblem& fit, const Linearisation& linear,
                                                 const Whitener& whitener,
                                                 const FitLayout& layout) const {
  const int of_sessions = nuisances_.of_sessions();
  const bool base = nuisances_.FloatWithBase();
  const int columns = of_sessions + (base ? 6 : 0);
  Eigen::MatrixXd frames = Eigen::MatrixXd::Zero(layout.total(), columns);
  if (columns == 0) return frames;
  for (const FitRowIndex j : fit.rows.indices()) {
    const RowIndex row = fit.rows[j];
    const FrameGradient& derivative = linear.rows[row].frames;
    auto of_row = layout.PartOf(frames, j);
    nuisances_.ForEachFrameBlock(derivative, row, [&](const auto& block, int first) {
      whitener[j].Apply(block, of_row.middleCols(first, block.cols()));
    });
    if (base) whitener[j].Apply(derivative.leftCols<6>(), of_row.middleCols(of_sessions, 6));
  }
  return frames;
}

void NuisanceProjection::AddPart(const FitProblem& fit, const Linearisation& linear,
                                 const Model& model, const Whitener& whitener,
                                 const FitLayout& layout, ComponentIndex component,
                                 const std::vector<FitRowIndex>& rows, int& equation) {
  const std::vector<Equation> equations = nuisances_.EquationsAt(model, component);
  Part part;
  part.rows = rows;
  std::vector<int> column_of(static_cast<std::size_t>(nuisances_.size()), -1);
  int columns = 0;
  for (const GroupIndex group : nuisances_.GroupsOf(component)) {
    const auto first = static_cast<std::size_t>(nuisances_.FirstOf(group));
    const auto count = static_cast<std::size_t>(nuisances_.CountOf(group));
    for (std::size_t k = 0; k < count; ++k) column_of[first + k] = columns++;
  }
  for (const FitRowIndex j : rows) {
    for (int k = 0; k < layout.count(j); ++k) part.residuals.push_back(layout.first(j) + k);
  }
  for (std::size_t k = 0; k < equations.size(); ++k) part.residuals.push_back(equation++);
  if (part.residuals.empty()) return;
  Eigen::MatrixXd X =
      Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(part.residuals.size()), columns);
  Eigen::Index at = 0;
  for (const FitRowIndex j : rows) {
    const GroupIndex group = nuisances_.GroupOf(fit.rows[j]).value();
    const int first = column_of[nuisances_.FirstOf(group)];
    whitener[j].Apply(linear.rows[fit.rows[j]].own,
                      X.block(at, first, layout.count(j), nuisances_.CountOf(group)));
    at += layout.count(j);
  }
  for (const Equation& further : equations) {
    for (const auto& [nuisance, slope] : further.slopes) {
      X(at, column_of[nuisance]) = slope;
    }
    ++at;
  }
  part.basis = OrthonormalBasis(X, LargestColumn(X));
  parts_.push_back(std::move(part));
}

void NuisanceProjection::ProjectParts(Eigen::Ref<Eigen::MatrixXd> columns) const {
  Eigen::MatrixXd local;
  for (const Part& part : parts_) {
    local = columns(part.residuals, Eigen::all);
    local -= part.basis * (part.basis.transpose() * local).eval();
    columns(part.residuals, Eigen::all) = local;
  }
}

void NuisanceProjection::Project(Eigen::Ref<Eigen::MatrixXd> columns) const {
  ProjectParts(columns);
  if (frames_.cols() > 0) columns -= frames_ * (frames_.transpose() * columns).eval();
}

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
  without_effects_.resize(linear.rows.size());
  std::set<ClusterIndex> clusters;
  for (const FitRowIndex j : fit_.rows.indices()) {
    const RowIndex row = fit_.rows[j];
    const double weight = fit_.weights[row];
    freedom_ += weight * layout_.count(j);
    if (weight > 0.5 && layout_.count(j) > 0) clusters.insert(data.cluster_of[row]);
    const LinearRow& at = linear.rows[row];
    RowResidual& y = without_effects_[row];
    y = at.residual + DisplacementBy(model.effects, data, linear, row);
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
  Eigen::MatrixXd columns = WhitenedColumns(block);
  if (block.factors) {
    for (const FitRowIndex j : fit_.rows.indices())
      layout_.PartOf(columns, j) *= (*block.factors)[fit_.rows[j]];
  }
  if (projected) Project(columns);
  return columns;
}

Eigen::MatrixXd LinearProblem::WhitenedColumns(const Block& block) const {
  const ShapeSearch* const search = block.empirical() ? nullptr : ShapeSearchOf(*block.term.effect);
  if (search != nullptr) {
    if (std::optional<Eigen::MatrixXd> carried = search->Columns(*this, block))
      return *std::move(carried);
  }
  const int width = block.columns.count();
  Eigen::MatrixXd columns(layout_.total(), width);
  columns.bottomRows(equations_).setZero();  // no effect acts on what is known beside the rows
  if (!block.empirical() && search == nullptr) {
    const auto kept = linear_->columns->Of(fit_.data, *linear_, block, fit_.threads);
    for (const FitRowIndex j : fit_.rows.indices()) {
      whitener_[j].Apply(linear_->layout.PartOf(*kept, fit_.rows[j]), layout_.PartOf(columns, j));
    }
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
