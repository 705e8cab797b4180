#include "app/measure/diagnosis/search/explained_effects.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "app/measure/diagnosis/data/thresholds.h"
#include "app/measure/diagnosis/linear/shape_search.h"

namespace plumbline::measure {

bool HasEmpirical(const CandidateSet& candidate_set, const Explanation& explanation) {
  return std::ranges::any_of(explanation.blocks, [&candidate_set](BlockIndex block) {
    return candidate_set.blocks()[block].empirical();
  });
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

std::vector<BlockIndex> BlocksOfEffect(const CandidateSet& candidate_set,
                                       const Explanation& explanation, const EffectKey& key) {
  std::vector<BlockIndex> blocks;
  for (const BlockIndex block : explanation.blocks) {
    if (KeyOf(candidate_set.blocks()[block]) == key) blocks.push_back(block);
  }
  return blocks;
}

namespace {

/// True unless a block with a time constant fits no better than its limit, a time constant of zero,
/// by the evidence that rules out a rival: the rows do not show then that anything changes with
/// time.
bool BeatsItsLimit(const CandidateSet& candidate_set, const Explanation& explanation,
                   BlockIndex index) {
  const Block& block = candidate_set.blocks()[index];
  if (!HasContinuousShape(block) || LineOf(block)) return true;
  constexpr double kAlmostZero_s = 1e-6;
  Block limit = block;
  const auto& specs = block.term.effect->traits().parameters;
  for (BlockColumn& column : limit.columns) {
    for (std::size_t k = 0; k < column.values.size(); ++k) {
      const auto spec = static_cast<std::size_t>(block.term.parameters[k].spec);
      if (specs[spec].role == effects::ParameterRole::kShape) column.values[k] = kAlmostZero_s;
    }
  }
  const Eigen::VectorXd without = candidate_set.PartialResidual(explanation, index);
  const Eigen::MatrixXd columns = candidate_set.problem().Columns(limit, true);
  if (!columns.allFinite()) return true;  // the limit does not exist for times before zero
  const double left_by_limit =
      (without - columns * columns.colPivHouseholderQr().solve(without)).squaredNorm();
  return left_by_limit - candidate_set.Residual(explanation).squaredNorm() > kRivalGap;
}

}  // namespace

bool ShapesAreVisible(const CandidateSet& candidate_set, const Explanation& explanation) {
  return std::ranges::all_of(explanation.blocks, [&](BlockIndex index) {
    const Block& block = candidate_set.blocks()[index];
    const ShapeSearch* const search = ShapeSearchOf(*block.term.effect);
    if (search == nullptr) return true;
    ColumnSizes sizes;
    for (std::size_t i = 0; i < explanation.columns.size(); ++i) {
      const ColumnIndex column = explanation.columns[i];
      if (candidate_set.BlockOfColumn(column) != index) continue;
      sizes[candidate_set.WithinBlock(column)] = explanation.values[static_cast<int>(i)];
    }
    return sizes.empty() ||
           (search->Visible(candidate_set.problem(), search->EffectFrom(block, sizes)) &&
            BeatsItsLimit(candidate_set, explanation, index));
  });
}

double SignalLeft(const CandidateSet& candidate_set, const Explanation& explanation,
                  const EffectKey& key, const std::vector<BlockIndex>& rival) {
  Eigen::VectorXd field = Eigen::VectorXd::Zero(candidate_set.columns().rows());
  for (std::size_t i = 0; i < explanation.columns.size(); ++i) {
    const ColumnIndex column = explanation.columns[i];
    if (KeyOf(candidate_set.blocks()[candidate_set.BlockOfColumn(column)]) != key) continue;
    field += candidate_set.Displacement(column, explanation.values[static_cast<int>(i)]);
  }
  const Explanation of_rival = candidate_set.Fit(rival);
  const auto n = static_cast<int>(of_rival.columns.size());
  Eigen::MatrixXd columns(field.size(), n);
  for (int i = 0; i < n; ++i) {
    columns.col(i) = candidate_set.columns().col(of_rival.columns[i].value());
  }
  const double length = field.norm();
  if (length == 0) return 0;
  if (n == 0) return 1;
  const Eigen::VectorXd left = field - columns * columns.colPivHouseholderQr().solve(field);
  return left.norm() / length;
}

double LogChoices(const CandidateSet& candidate_set, const Explanation& explanation,
                  BlockIndex block) {
  std::set<int> visible, kept;
  for (const ColumnIndex column : candidate_set.ColumnsOf({block})) {
    visible.insert(candidate_set.UnitOfColumn(column));
  }
  for (const ColumnIndex column : explanation.columns) {
    if (candidate_set.BlockOfColumn(column) == block) {
      kept.insert(candidate_set.UnitOfColumn(column));
    }
  }
  const auto n = static_cast<double>(visible.size()), k = static_cast<double>(kept.size());
  return std::lgamma(n + 1) - std::lgamma(k + 1) - std::lgamma(n - k + 1);
}

}  // namespace plumbline::measure
