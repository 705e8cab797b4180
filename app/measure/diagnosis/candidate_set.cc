#include "app/measure/diagnosis/candidate_set.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <set>

namespace plumbline::measure {
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
