#include "app/measure/diagnosis/linear/candidate_set.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <map>
#include <string_view>

#include "app/measure/diagnosis/linear/linear_problem.h"
#include "firmware-like/statistics/statistics.h"

namespace plumbline::measure {
namespace {

constexpr double kMinObservable =
    1e-3;                         // share of a column's length left after projecting out the frames
constexpr double kMinSignal = 1;  // signal over all rows at the largest plausible size, in sigma

}  // namespace

std::vector<BlockIndex> CandidateColumns::Add(const std::vector<Block>& blocks) {
  const BlockIndex first(blocks_.size());
  std::vector<BlockIndex> indices;
  for (const Block& block : blocks) {
    const auto known = std::ranges::find_if(blocks_, [&](const Block& other) {
      return SameColumns(other, block) && other.factors == block.factors;
    });
    indices.push_back(known == blocks_.end() ? List(block) : BlockIndex(known - blocks_.begin()));
  }
  if (first.offset() < blocks_.size()) AddColumns(first);
  return indices;
}

BlockIndex CandidateColumns::List(const Block& block) {
  const BlockIndex index(blocks_.size());
  blocks_.push_back(block);
  first_.emplace_back(block_of_.size());
  for (const BlockColumnIndex k : block.columns.indices()) {
    block_of_.push_back(index);
    local_.push_back(k);
  }
  return index;
}

void CandidateColumns::AddColumns(BlockIndex first) {
  const double rows = static_cast<double>(problem_.rows().size());
  const auto width = static_cast<int>(block_of_.size()) - used_;
  if (used_ + width > columns_.cols()) {
    const int room = 2 * (used_ + width) + 64;
    columns_.conservativeResize(problem_.layout().total(), room);
    gram_.conservativeResize(room, room);
    moment_.conservativeResize(room);
  }
  auto added = columns_.middleCols(used_, width);
  std::vector<double> raw_lengths;
  const IndexRange<BlockIndex> blocks(first, BlockIndex(blocks_.size()));
  for (const BlockIndex block : blocks) {
    columns_.middleCols(first_[block].value(), blocks_[block].columns.count()) =
        problem_.Columns(blocks_[block], false);
  }
  for (const auto column : added.colwise()) {
    raw_lengths.push_back(column.norm());
    raw_rms_m_.push_back(LengthOfLengths(column) * problem_.sigma_m() / std::sqrt(rows));
  }
  problem_.Project(added);
  Normalise(added, raw_lengths);
  ExtendGram(width);
}

void CandidateColumns::Normalise(Eigen::Ref<Eigen::MatrixXd> added,
                                 const std::vector<double>& raw_lengths) {
  for (int k = 0; k < static_cast<int>(added.cols()); ++k) {
    auto column = added.col(k);
    const double length = column.norm();
    const bool seen = length > kMinObservable * raw_lengths[k] &&
                      length * At(ColumnIndex(used_ + k)).Largest() > kMinSignal;
    length_.push_back(seen ? length : 0);
    if (seen) {
      column /= length;
    } else {
      column.setZero();
    }
  }
}

void CandidateColumns::ExtendGram(int width) {
  const auto added = columns_.middleCols(used_, width);
  gram_.block(0, used_, used_, width).noalias() = columns_.leftCols(used_).transpose() * added;
  gram_.block(used_, 0, width, used_) = gram_.block(0, used_, used_, width).transpose();
  Eigen::MatrixXd own = Eigen::MatrixXd::Zero(width, width);
  own.selfadjointView<Eigen::Lower>().rankUpdate(added.transpose());
  gram_.block(used_, used_, width, width) = own.selfadjointView<Eigen::Lower>();
  moment_.segment(used_, width) = added.transpose() * problem_.response();
  used_ += width;
}

double CandidateColumns::LengthOfLengths(const Eigen::Ref<const Eigen::VectorXd>& column) const {
  const FitLayout& layout = problem_.layout();
  double square = 0;
  for (const FitRowIndex j : problem_.rows().indices()) {
    const auto of_row = layout.PartOf(column, j);
    square += of_row.head(std::min<Eigen::Index>(of_row.size(), kMaxLengths)).squaredNorm();
  }
  return std::sqrt(square);
}

IndexRange<ColumnIndex> CandidateColumns::ColumnsIn(BlockIndex block) const {
  const ColumnIndex first = first_[block];
  return {first, ColumnIndex(first.value() + blocks_[block].columns.count())};
}

std::vector<ColumnIndex> CandidateColumns::ObservableIn(std::vector<BlockIndex> blocks) const {
  std::ranges::sort(blocks);
  blocks.erase(std::unique(blocks.begin(), blocks.end()), blocks.end());
  std::vector<ColumnIndex> columns;
  for (const BlockIndex block : blocks) {
    for (const ColumnIndex column : ColumnsIn(block)) {
      if (length_[column] > 0) columns.push_back(column);
    }
  }
  return columns;
}

int CandidateColumns::JointOf(ColumnIndex column) const {
  const Block& block = blocks_[block_of_[column]];
  if (block.empirical()) return -1;
  const auto parameter = static_cast<std::size_t>(At(column).parameter);
  return block.term.parameters[parameter].joint;
}

double CandidateColumns::PriorPrecision(ColumnIndex column) const {
  const double deviation = length_[column] * At(column).Largest();
  return deviation > 0 ? 1 / (deviation * deviation) : 0;
}

model::Interval CandidateColumns::Bounds(ColumnIndex column) const {
  const model::Interval& plausible = At(column).plausible;
  const double scale = kDiscardRatio * length_[column];
  return {scale * plausible.low, scale * plausible.high};
}

SelectionCosts::SelectionCosts(const LinearProblem& problem)
    : effect_cost_(2 * std::log(EffectsConsidered(problem.data()))) {}

void SelectionCosts::Extend(const CandidateColumns& columns) {
  for (BlockIndex block(inflation_.size()); block.offset() < columns.blocks().size();
       block = BlockIndex(inflation_.size())) {
    double inflation = 1;
    for (const ColumnIndex column : columns.ColumnsIn(block)) {
      inflation = std::max(
          inflation, VarianceInflation(columns.problem(), columns.matrix().col(column.value())));
    }
    inflation_.push_back(inflation);
    unit_costs_.push_back(UnitCosts(columns.problem(), columns.blocks()[block], inflation));
  }
}

std::vector<double> SelectionCosts::UnitCosts(const LinearProblem& problem, const Block& block,
                                              double inflation) const {
  std::vector<int> widths(static_cast<std::size_t>(block.units), 0);
  for (const BlockColumn& column : block.columns) ++widths[column.unit];
  std::vector<double> costs;
  std::map<int, double> quantiles;
  for (const int width : widths) {
    const double evidence = width * std::log(static_cast<double>(problem.clusters()));
    double& quantile = quantiles[width];
    if (quantile == 0 && block.units > 1) {
      quantile = statistics::ChiSquareQuantile(kJointFamilyError / block.units, width);
    }
    costs.push_back(inflation * std::max(evidence, quantile));
  }
  return costs;
}

double SelectionCosts::OfBlock(const Block& block, BlockIndex index) const {
  return inflation_[index] * 2 * std::log(std::max(1.0, block.trials));
}

double SelectionCosts::OfBlocks(const CandidateColumns& columns,
                                const std::set<BlockIndex>& blocks) const {
  double cost = 0;
  for (const BlockIndex block : blocks) cost += OfBlock(columns.blocks()[block], block);
  return cost + effect_cost_ * WeightedEffectCount(columns, blocks);
}

double SelectionCosts::Minimum(const CandidateColumns& candidates,
                               const std::vector<ColumnIndex>& columns) const {
  std::map<BlockIndex, double> cheapest;  // cost of the cheapest unit of each block
  for (const ColumnIndex column : columns) {
    const double cost = OfUnit(candidates.BlockOf(column), candidates.At(column).unit);
    const auto [known, fresh] = cheapest.emplace(candidates.BlockOf(column), cost);
    if (!fresh) known->second = std::min(known->second, cost);
  }
  std::set<BlockIndex> used;
  double cost = 0;
  for (const auto& [block, unit] : cheapest) {
    used.insert(block);
    cost += unit;
  }
  return cost + OfBlocks(candidates, used);
}

double SelectionCosts::WeightedEffectCount(const CandidateColumns& columns,
                                           const std::set<BlockIndex>& blocks) const {
  std::map<std::string_view, double> inflations;  // largest inflation of each id
  double effect_count = 0;
  for (const BlockIndex index : blocks) {
    const Block& block = columns.blocks()[index];
    if (ActsFromEventTime(block.term)) {
      effect_count += inflation_[index];
    } else {
      double& largest = inflations[block.id];
      largest = std::max(largest, inflation_[index]);
    }
  }
  for (const auto& [id, inflation] : inflations) effect_count += inflation;
  return effect_count;
}

namespace {

constexpr double kMinPivot = 1e-6;  // squared sine of the angle to the span of the previous columns

}  // namespace

CandidateSet::CandidateSet(const LinearProblem& problem)
    : columns_(problem), costs_(problem), chi2_null_(problem.response().squaredNorm()) {}

std::vector<BlockIndex> CandidateSet::Add(const std::vector<Block>& blocks) {
  std::vector<BlockIndex> indices = columns_.Add(blocks);
  costs_.Extend(columns_);
  return indices;
}

Explanation CandidateSet::Evaluate(std::vector<BlockIndex> support) const {
  return *EvaluateBelow(std::move(support), HUGE_VAL);
}

std::optional<Explanation> CandidateSet::EvaluateBelow(std::vector<BlockIndex> support,
                                                       double worst) const {
  const Basis basis = IndependentColumns(ColumnsOf(std::move(support)));
  if (basis.chi2 + costs_.Minimum(columns_, basis.columns) > worst) return std::nullopt;
  SupportFit fit = FitOf(basis.columns);
  std::vector<model::Interval> bounds;
  bounds.reserve(basis.columns.size());
  for (const ColumnIndex column : basis.columns) bounds.push_back(columns_.Bounds(column));
  do {
    fit.Eliminate();
  } while (fit.DropOutOfBounds(bounds));
  return ExplanationOf(basis.columns, fit);
}

Explanation CandidateSet::Fit(const std::vector<BlockIndex>& support) const {
  return FitColumns(ColumnsOf(support));
}

Explanation CandidateSet::FitColumns(const std::vector<ColumnIndex>& columns) const {
  const Basis basis = IndependentColumns(columns);
  return ExplanationOf(basis.columns, FitOf(basis.columns));
}

/// Pivoted Cholesky decomposition, stopped at the minimum pivot, so that the selected columns are
/// well conditioned. They are returned in their original order.
CandidateSet::Basis CandidateSet::IndependentColumns(
    const std::vector<ColumnIndex>& columns) const {
  const auto n = static_cast<int>(columns.size());
  Basis basis;
  basis.chi2 = chi2_null_;
  // Row-major, because the dot products below run along rows.
  using ByRows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  ByRows L = ByRows::Zero(n, n);
  Eigen::VectorXd left(n), along(n);
  const auto column = [&columns](int place) { return columns[place]; };
  for (int i = 0; i < n; ++i) left[i] = columns_.Gram(column(i), column(i));
  std::vector<int> chosen;
  for (int r = 0; r < n; ++r) {
    int best = 0;
    if (!(left.maxCoeff(&best) > kMinPivot)) break;
    const double root = std::sqrt(left[best]);
    const ColumnIndex pivot = column(best);
    for (int i = 0; i < n; ++i) {
      if (left[i] < -0.5) continue;  // already selected
      const double dot =
          columns_.Gram(column(i), pivot) - L.row(i).head(r).dot(L.row(best).head(r));
      L(i, r) = dot / root;
      left[i] -= L(i, r) * L(i, r);
    }
    along[r] = (columns_.Moment(pivot) - L.row(best).head(r).dot(along.head(r))) / root;
    basis.chi2 -= along[r] * along[r];
    left[best] = -1;
    chosen.push_back(best);
  }
  std::ranges::sort(chosen);
  for (const int place : chosen) basis.columns.push_back(columns[place]);
  return basis;
}

SupportFit CandidateSet::FitOf(const std::vector<ColumnIndex>& columns) const {
  const auto n = static_cast<int>(columns.size());
  Eigen::MatrixXd gram(n, n);
  Eigen::VectorXd moment(n);
  std::vector<SupportFit::Unit> units;
  for (int i = 0; i < n; ++i) {
    const ColumnIndex column = columns[i];
    moment[i] = columns_.Moment(column);
    for (int j = 0; j < n; ++j) {
      gram(i, j) = columns_.Gram(column, columns[j]);
    }
    gram(i, i) += columns_.PriorPrecision(column);
    const BlockIndex block = columns_.BlockOf(column);
    const int number = columns_.At(column).unit;
    const auto same = std::find_if(units.rbegin(), units.rend(), [&](const SupportFit::Unit& unit) {
      return unit.block == block && unit.number == number;
    });
    if (same != units.rend()) {
      same->places.push_back(i);
    } else {
      units.push_back({block, number, {i}, UnitCost(block, number)});
    }
  }
  return SupportFit(gram, moment, chi2_null_, std::move(units));
}

Explanation CandidateSet::ExplanationOf(const std::vector<ColumnIndex>& columns,
                                        const SupportFit& fit) const {
  Explanation explanation;
  const std::vector<int> places = fit.Places();
  explanation.values.resize(static_cast<int>(places.size()));
  double prior = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const ColumnIndex column = columns[places[i]];
    const double value = fit.Value(places[i]);
    explanation.columns.push_back(column);
    explanation.values[static_cast<int>(i)] = value / columns_.Length(column);
    prior += value * value * columns_.PriorPrecision(column);
  }
  explanation.chi2 = std::max(0.0, fit.minimum() - prior);
  explanation.prior = prior;
  explanation.score = explanation.chi2 + prior;
  std::set<BlockIndex> used;
  for (const SupportFit::Unit& unit : fit.units()) {
    explanation.score += unit.cost;
    used.insert(unit.block);
  }
  explanation.score += costs_.OfBlocks(columns_, used);
  explanation.blocks.assign(used.begin(), used.end());
  return explanation;
}

Eigen::VectorXd CandidateSet::Displacement(ColumnIndex column, double value) const {
  return columns().col(column.value()) * (value * columns_.Length(column));
}

Eigen::VectorXd CandidateSet::Residual(const Explanation& explanation) const {
  return ResidualBeside(explanation, std::nullopt);
}

Eigen::VectorXd CandidateSet::PartialResidual(const Explanation& explanation,
                                              BlockIndex block) const {
  return ResidualBeside(explanation, block);
}

Eigen::VectorXd CandidateSet::ResidualBeside(const Explanation& explanation,
                                             std::optional<BlockIndex> left_in) const {
  Eigen::VectorXd residual = problem().response();
  for (std::size_t i = 0; i < explanation.columns.size(); ++i) {
    const ColumnIndex column = explanation.columns[i];
    if (columns_.BlockOf(column) == left_in) continue;
    residual -= Displacement(column, explanation.values[static_cast<int>(i)]);
  }
  return residual;
}

Coefficients CandidateSet::CoefficientsOf(const Explanation& explanation) const {
  Coefficients coefficients;
  for (std::size_t i = 0; i < explanation.columns.size(); ++i) {
    const ColumnIndex column = explanation.columns[i];
    coefficients[{columns_.BlockOf(column), columns_.WithinBlock(column)}] =
        explanation.values[static_cast<int>(i)];
  }
  return coefficients;
}

Indexed<BlockColumnIndex, double> CandidateSet::MinimumDetectable(BlockIndex block,
                                                                  double block_cost) const {
  constexpr double kPower90 = 1.2816;
  Indexed<BlockColumnIndex, double> sizes(blocks()[block].columns.size(), 0.0);
  for (const ColumnIndex column : columns_.ColumnsIn(block)) {
    if (columns_.Length(column) == 0) continue;
    const BlockColumn& unknown = columns_.At(column);
    const double threshold =
        UnitCost(block, unknown.unit) + block_cost + EffectCost() * Inflation(block);
    const double value = (std::sqrt(threshold) + kPower90) / columns_.Length(column);
    if (value < unknown.Largest())
      sizes[columns_.WithinBlock(column)] = value * columns_.RawRms_m(column);
  }
  return sizes;
}

}  // namespace plumbline::measure
