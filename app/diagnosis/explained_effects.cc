#include "app/diagnosis/explained_effects.h"

#include <algorithm>
#include <cmath>
#include <set>

namespace plumbline::diagnosis {

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

std::vector<BlockIndex> BlocksOfEffect(const CandidateSet& candidate_set,
                                       const Explanation& explanation, const EffectKey& key) {
  std::vector<BlockIndex> of;
  for (const BlockIndex block : explanation.blocks) {
    if (KeyOf(candidate_set.blocks()[block]) == key) of.push_back(block);
  }
  return of;
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
    columns.col(i) =
        candidate_set.columns().col(of_rival.columns[static_cast<std::size_t>(i)].value());
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

}  // namespace plumbline::diagnosis
