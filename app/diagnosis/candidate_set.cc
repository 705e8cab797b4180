#include "app/diagnosis/candidate_set.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "app/diagnosis/row_correlation.h"
#include "app/diagnosis/thresholds.h"
#include "firmware-like/statistics/chi_square.h"

namespace plumbline::diagnosis {
namespace {

constexpr double kMinObservable =
    1e-3;                         // share of a column's length left after projecting out the frames
constexpr double kMinSignal = 1;  // signal over all rows at the largest plausible size, in sigma
constexpr double kMinPivot = 1e-6;  // squared sine of the angle to the span of the previous columns

}  // namespace

CandidateSet::CandidateSet(const LinearProblem& problem)
    : problem_(problem),
      chi2_null_(problem.response().squaredNorm()),
      effect_cost_(2 * std::log(EffectsConsidered(problem.data()))) {}

std::vector<BlockIndex> CandidateSet::Add(const std::vector<Block>& blocks) {
  const BlockIndex first(blocks_.size());
  std::vector<BlockIndex> indices;
  for (const Block& block : blocks) {
    const auto known = std::find_if(blocks_.begin(), blocks_.end(),
                                    [&](const Block& other) { return SameColumns(other, block); });
    indices.push_back(known == blocks_.end() ? List(block) : BlockIndex(known - blocks_.begin()));
  }
  if (first.offset() < blocks_.size()) AddColumns(first);
  return indices;
}

BlockIndex CandidateSet::List(const Block& block) {
  const BlockIndex index(blocks_.size());
  blocks_.push_back(block);
  first_.emplace_back(block_of_.size());
  for (const BlockColumnIndex k : block.columns.indices()) {
    block_of_.push_back(index);
    local_.push_back(k);
  }
  return index;
}

void CandidateSet::AddColumns(BlockIndex first) {
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
  for (int k = 0; k < width; ++k) {
    auto column = added.col(k);
    const double length = column.norm();
    const bool seen = length > kMinObservable * raw_lengths[static_cast<std::size_t>(k)] &&
                      length * ColumnAt(ColumnIndex(used_ + k)).Largest() > kMinSignal;
    length_.push_back(seen ? length : 0);
    if (seen) {
      column /= length;
    } else {
      column.setZero();
    }
  }
  for (const BlockIndex block : blocks) {
    double inflation = 1;
    for (const ColumnIndex column : ColumnsIn(block)) {
      inflation = std::max(inflation, VarianceInflation(problem_, columns_.col(column.value())));
    }
    inflation_.push_back(inflation);
    unit_costs_.push_back(UnitCosts(block));
  }
  ExtendGram(width);
}

void CandidateSet::ExtendGram(int width) {
  const auto added = columns_.middleCols(used_, width);
  gram_.block(0, used_, used_, width).noalias() = columns_.leftCols(used_).transpose() * added;
  gram_.block(used_, 0, width, used_) = gram_.block(0, used_, used_, width).transpose();
  Eigen::MatrixXd own = Eigen::MatrixXd::Zero(width, width);
  own.selfadjointView<Eigen::Lower>().rankUpdate(added.transpose());
  gram_.block(used_, used_, width, width) = own.selfadjointView<Eigen::Lower>();
  moment_.segment(used_, width) = added.transpose() * problem_.response();
  used_ += width;
}

double CandidateSet::LengthOfLengths(const Eigen::Ref<const Eigen::VectorXd>& column) const {
  const FitLayout& layout = problem_.layout();
  double square = 0;
  for (const FitRowIndex j : problem_.rows().indices()) {
    const auto of_row = layout.PartOf(column, j);
    square += of_row.head(std::min<Eigen::Index>(of_row.size(), kMaxLengths)).squaredNorm();
  }
  return std::sqrt(square);
}

IndexRange<ColumnIndex> CandidateSet::ColumnsIn(BlockIndex block) const {
  const ColumnIndex first = first_[block];
  return {first, ColumnIndex(first.value() + blocks_[block].columns.count())};
}

bool CandidateSet::Observable(BlockIndex block) const {
  const IndexRange<ColumnIndex> columns = ColumnsIn(block);
  return std::any_of(columns.begin(), columns.end(),
                     [this](ColumnIndex column) { return length_[column] > 0; });
}

double CandidateSet::PriorPrecision(ColumnIndex column) const {
  const double deviation = length_[column] * ColumnAt(column).Largest();
  return deviation > 0 ? 1 / (deviation * deviation) : 0;
}

model::Interval CandidateSet::Bounds(ColumnIndex column) const {
  const model::Interval& plausible = ColumnAt(column).plausible;
  const double scale = kDiscardRatio * length_[column];
  return {scale * plausible.low, scale * plausible.high};
}

std::vector<double> CandidateSet::UnitCosts(BlockIndex index) const {
  const Block& block = blocks_[index];
  std::vector<int> widths(static_cast<std::size_t>(block.units), 0);
  for (const BlockColumn& column : block.columns) ++widths[static_cast<std::size_t>(column.unit)];
  std::vector<double> costs;
  std::map<int, double> quantiles;
  for (const int width : widths) {
    const double evidence = width * std::log(static_cast<double>(problem_.clusters()));
    double& quantile = quantiles[width];
    if (quantile == 0 && block.units > 1) {
      quantile = statistics::ChiSquareQuantile(kJointFamilyError / block.units, width);
    }
    costs.push_back(inflation_[index] * std::max(evidence, quantile));
  }
  return costs;
}

double CandidateSet::BlockCost(BlockIndex block) const {
  return inflation_[block] * 2 * std::log(std::max(1.0, blocks_[block].trials));
}

Explanation CandidateSet::Evaluate(std::vector<BlockIndex> support) const {
  return *EvaluateBelow(std::move(support), HUGE_VAL);
}

std::optional<Explanation> CandidateSet::EvaluateBelow(std::vector<BlockIndex> support,
                                                       double worst) const {
  const Basis basis = IndependentColumns(ColumnsOf(std::move(support)));
  if (basis.chi2 + MinCost(basis.columns) > worst) return std::nullopt;
  SupportFit fit = FitOf(basis.columns);
  std::vector<model::Interval> bounds;
  bounds.reserve(basis.columns.size());
  for (const ColumnIndex column : basis.columns) bounds.push_back(Bounds(column));
  do {
    fit.Eliminate();
  } while (fit.DropOutOfBounds(bounds));
  return ExplanationOf(basis.columns, fit);
}

double CandidateSet::MinCost(const std::vector<ColumnIndex>& columns) const {
  std::map<BlockIndex, double> cheapest;  // cost of the cheapest unit of each block
  for (const ColumnIndex column : columns) {
    const double cost = UnitCost(block_of_[column], ColumnAt(column).unit);
    const auto [known, fresh] = cheapest.emplace(block_of_[column], cost);
    if (!fresh) known->second = std::min(known->second, cost);
  }
  std::set<BlockIndex> used;
  double cost = 0;
  for (const auto& [block, unit] : cheapest) {
    used.insert(block);
    cost += unit + BlockCost(block);
  }
  return cost + effect_cost_ * WeightedEffectCount(used);
}

double CandidateSet::WeightedEffectCount(const std::set<BlockIndex>& blocks) const {
  std::map<std::string_view, double> inflations;  // largest inflation of each id
  double effect_count = 0;
  for (const BlockIndex index : blocks) {
    const Block& block = blocks_[index];
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

Explanation CandidateSet::Fit(const std::vector<BlockIndex>& support) const {
  return FitColumns(ColumnsOf(support));
}

Explanation CandidateSet::FitColumns(const std::vector<ColumnIndex>& columns) const {
  const Basis basis = IndependentColumns(columns);
  return ExplanationOf(basis.columns, FitOf(basis.columns));
}

std::vector<ColumnIndex> CandidateSet::ColumnsOf(std::vector<BlockIndex> support) const {
  std::sort(support.begin(), support.end());
  support.erase(std::unique(support.begin(), support.end()), support.end());
  std::vector<ColumnIndex> columns;
  for (const BlockIndex block : support) {
    for (const ColumnIndex column : ColumnsIn(block)) {
      if (length_[column] > 0) columns.push_back(column);
    }
  }
  return columns;
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
  const auto column = [&columns](int place) {
    return columns[static_cast<std::size_t>(place)].value();
  };
  for (int i = 0; i < n; ++i) left[i] = gram_(column(i), column(i));
  std::vector<int> chosen;
  for (int r = 0; r < n; ++r) {
    int best = 0;
    if (!(left.maxCoeff(&best) > kMinPivot)) break;
    const double root = std::sqrt(left[best]);
    const int pivot = column(best);
    for (int i = 0; i < n; ++i) {
      if (left[i] < -0.5) continue;  // already selected
      const double dot = gram_(column(i), pivot) - L.row(i).head(r).dot(L.row(best).head(r));
      L(i, r) = dot / root;
      left[i] -= L(i, r) * L(i, r);
    }
    along[r] = (moment_[pivot] - L.row(best).head(r).dot(along.head(r))) / root;
    basis.chi2 -= along[r] * along[r];
    left[best] = -1;
    chosen.push_back(best);
  }
  std::sort(chosen.begin(), chosen.end());
  for (const int place : chosen) basis.columns.push_back(columns[static_cast<std::size_t>(place)]);
  return basis;
}

SupportFit CandidateSet::FitOf(const std::vector<ColumnIndex>& columns) const {
  const auto n = static_cast<int>(columns.size());
  Eigen::MatrixXd gram(n, n);
  Eigen::VectorXd moment(n);
  std::vector<SupportFit::Unit> units;
  for (int i = 0; i < n; ++i) {
    const ColumnIndex column = columns[static_cast<std::size_t>(i)];
    moment[i] = moment_[column.value()];
    for (int j = 0; j < n; ++j) {
      gram(i, j) = gram_(column.value(), columns[static_cast<std::size_t>(j)].value());
    }
    gram(i, i) += PriorPrecision(column);
    const BlockIndex block = block_of_[column];
    const int number = ColumnAt(column).unit;
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
    const ColumnIndex column = columns[static_cast<std::size_t>(places[i])];
    const double value = fit.Value(places[i]);
    explanation.columns.push_back(column);
    explanation.values[static_cast<int>(i)] = value / length_[column];
    prior += value * value * PriorPrecision(column);
  }
  explanation.chi2 = std::max(0.0, fit.minimum() - prior);
  explanation.prior = prior;
  explanation.score = explanation.chi2 + prior;
  std::set<BlockIndex> used;
  for (const SupportFit::Unit& unit : fit.units()) {
    explanation.score += unit.cost;
    used.insert(unit.block);
  }
  for (const BlockIndex block : used) explanation.score += BlockCost(block);
  explanation.score += effect_cost_ * WeightedEffectCount(used);
  explanation.blocks.assign(used.begin(), used.end());
  return explanation;
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
  Eigen::VectorXd residual = problem_.response();
  for (std::size_t i = 0; i < explanation.columns.size(); ++i) {
    const ColumnIndex column = explanation.columns[i];
    if (block_of_[column] == left_in) continue;
    residual -=
        columns_.col(column.value()) * (explanation.values[static_cast<int>(i)] * length_[column]);
  }
  return residual;
}

Coefficients CandidateSet::CoefficientsOf(const Explanation& explanation) const {
  Coefficients coefficients;
  for (std::size_t i = 0; i < explanation.columns.size(); ++i) {
    const ColumnIndex column = explanation.columns[i];
    coefficients[{block_of_[column], local_[column]}] = explanation.values[static_cast<int>(i)];
  }
  return coefficients;
}

double CandidateSet::LogChoices(const Explanation& explanation, BlockIndex block) const {
  std::set<int> visible, kept;
  for (const ColumnIndex column : ColumnsIn(block)) {
    if (length_[column] > 0) visible.insert(ColumnAt(column).unit);
  }
  for (const ColumnIndex column : explanation.columns) {
    if (block_of_[column] == block) kept.insert(ColumnAt(column).unit);
  }
  const auto n = static_cast<double>(visible.size()), k = static_cast<double>(kept.size());
  return std::lgamma(n + 1) - std::lgamma(k + 1) - std::lgamma(n - k + 1);
}

std::vector<BlockIndex> CandidateSet::BlocksOf(const Explanation& explanation,
                                               const EffectKey& key) const {
  std::vector<BlockIndex> of;
  for (const BlockIndex block : explanation.blocks) {
    if (KeyOf(blocks_[block]) == key) of.push_back(block);
  }
  return of;
}

std::vector<BlockIndex> CandidateSet::OtherBlocks(const Explanation& explanation,
                                                  const EffectKey& key) const {
  std::vector<BlockIndex> beside;
  for (const BlockIndex block : explanation.blocks) {
    if (KeyOf(blocks_[block]) != key) beside.push_back(block);
  }
  return beside;
}

double CandidateSet::SignalLeft(const Explanation& explanation, const EffectKey& key,
                                const std::vector<BlockIndex>& rival) const {
  Eigen::VectorXd field = Eigen::VectorXd::Zero(columns_.rows());
  for (std::size_t i = 0; i < explanation.columns.size(); ++i) {
    const ColumnIndex column = explanation.columns[i];
    if (KeyOf(blocks_[block_of_[column]]) != key) continue;
    field +=
        columns_.col(column.value()) * (explanation.values[static_cast<int>(i)] * length_[column]);
  }
  const Explanation of_rival = Fit(rival);
  const auto n = static_cast<int>(of_rival.columns.size());
  Eigen::MatrixXd columns(columns_.rows(), n);
  for (int i = 0; i < n; ++i) {
    columns.col(i) = columns_.col(of_rival.columns[static_cast<std::size_t>(i)].value());
  }
  const double length = field.norm();
  if (length == 0) return 0;
  if (n == 0) return 1;
  const Eigen::VectorXd left = field - columns * columns.colPivHouseholderQr().solve(field);
  return left.norm() / length;
}

Indexed<BlockColumnIndex, double> CandidateSet::MinimumDetectable(BlockIndex block,
                                                                  double block_cost) const {
  constexpr double kPower90 = 1.2816;
  Indexed<BlockColumnIndex, double> sizes(blocks_[block].columns.size(), 0.0);
  for (const ColumnIndex column : ColumnsIn(block)) {
    if (length_[column] == 0) continue;
    const BlockColumn& of = ColumnAt(column);
    const double threshold =
        UnitCost(block, of.unit) + block_cost + effect_cost_ * Inflation(block);
    const double value = (std::sqrt(threshold) + kPower90) / length_[column];
    if (value < of.Largest()) sizes[local_[column]] = value * raw_rms_m_[column];
  }
  return sizes;
}

int CandidateSet::JointOfColumn(ColumnIndex column) const {
  const Block& block = blocks_[block_of_[column]];
  if (block.empirical()) return -1;
  const auto parameter = static_cast<std::size_t>(ColumnAt(column).parameter);
  return block.term.parameters[parameter].joint;
}

EffectKey KeyOf(const Block& block) {
  return {block.id, std::string(block.term.word)};
}

bool HasEmpirical(const CandidateSet& candidate_set, const Explanation& explanation) {
  return std::any_of(
      explanation.blocks.begin(), explanation.blocks.end(),
      [&candidate_set](BlockIndex block) { return candidate_set.blocks()[block].empirical(); });
}

std::vector<EffectKey> EffectKeys(const CandidateSet& candidate_set,
                                  const Explanation& explanation) {
  std::set<EffectKey> keys;
  for (const BlockIndex block : explanation.blocks)
    keys.insert(KeyOf(candidate_set.blocks()[block]));
  return {keys.begin(), keys.end()};
}

std::vector<std::string> EffectIds(const CandidateSet& candidate_set,
                                   const Explanation& explanation) {
  std::set<std::string> ids;
  for (const BlockIndex block : explanation.blocks) ids.insert(candidate_set.blocks()[block].id);
  return {ids.begin(), ids.end()};
}

}  // namespace plumbline::diagnosis
