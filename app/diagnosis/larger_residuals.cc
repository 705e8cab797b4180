#include "app/diagnosis/larger_residuals.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>
#include <vector>

#include "app/diagnosis/outlier_condition.h"
#include "app/diagnosis/thresholds.h"
#include "firmware-like/statistics/median.h"

namespace plumbline::diagnosis {
namespace {

constexpr int kMinPoses = 3;
// Points whose errors are half as large again hold a 95 % radius in about 70 %.
constexpr double kMinRatio = 1.5;

/// A pose in the order of the file: its first row, the mean size of its visits, and the rank of
/// that size, from 1.
struct RankedPose {
  RowIndex row{0};
  double size = 0;
  double rank = 0;
};

/// Ranks by size; equal sizes have their mean rank.
void Rank(std::vector<RankedPose>& poses) {
  std::vector<std::size_t> order(poses.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return poses[a].size < poses[b].size; });
  for (std::size_t first = 0; first < order.size();) {
    std::size_t end = first + 1;
    while (end < order.size() && poses[order[end]].size == poses[order[first]].size) ++end;
    for (std::size_t k = first; k < end; ++k)
      poses[order[k]].rank = 0.5 * static_cast<double>(first + 1 + end);
    first = end;
  }
}

std::vector<RankedPose> RankedPoses(const Dataset& data, const PerRow<double>& sizes) {
  std::map<ClusterIndex, std::size_t> at;
  std::vector<RankedPose> poses;
  std::vector<int> visits;
  for (const RowIndex row : data.row_indices()) {
    if (data.numbers[row].count == 0) continue;
    const auto [pose, is_new] = at.emplace(data.cluster_of[row], poses.size());
    if (is_new) {
      poses.push_back({row});
      visits.push_back(0);
    }
    poses[pose->second].size += sizes[row];
    ++visits[pose->second];
  }
  for (std::size_t k = 0; k < poses.size(); ++k) poses[k].size /= visits[k];
  Rank(poses);
  return poses;
}

/// The sum of the ranks of `some` of `all` poses in standard deviations from its mean by chance.
double Standardised(double sum, std::size_t some, std::size_t all) {
  const auto k = static_cast<double>(some), n = static_cast<double>(all);
  return (sum - k * (n + 1) / 2) / std::sqrt(k * (n - k) * (n + 1) / 12);
}

/// Probability of a standard normal variable above z.
double NormalTail(double z) {
  return 0.5 * std::erfc(z / std::sqrt(2.0));
}

double MedianRatio(std::vector<double> these, std::vector<double> others) {
  if (these.empty() || others.empty()) return 0;
  return statistics::MedianOf(these) / statistics::MedianOf(others);
}

/// A limit, and the probability of the residuals beyond it, multiplied by the number of limits
/// tried.
struct Limit {
  RowCondition condition;
  double p_value = HUGE_VAL;
};

/// The best limit of one signal, from above or below.
Limit BestLimitOf(const RecordedSignal& signal, std::vector<RankedPose> poses) {
  Limit best;
  double largest = -HUGE_VAL;
  int trials = 0;
  for (const bool above : {false, true}) {
    std::sort(poses.begin(), poses.end(), [&](const RankedPose& a, const RankedPose& b) {
      const double x = signal.values[a.row], y = signal.values[b.row];
      return above ? x > y : x < y;
    });
    double sum = 0;
    for (std::size_t k = 0; k + kMinPoses < poses.size(); ++k) {
      sum += poses[k].rank;
      const double value = signal.values[poses[k].row];
      if (k + 1 < kMinPoses || value == signal.values[poses[k + 1].row]) continue;
      ++trials;
      const double z = Standardised(sum, k + 1, poses.size());
      if (z <= largest) continue;
      largest = z;
      best.condition = {signal.column, "", value, above};
    }
  }
  if (trials > 0) best.p_value = trials * NormalTail(largest);
  return best;
}

}  // namespace

std::optional<LargerUnderCondition> LargerUnderSomeCondition(const Dataset& data,
                                                             const PerRow<double>& sizes) {
  const std::vector<RankedPose> poses = RankedPoses(data, sizes);
  Limit best;
  int columns = 0;
  for (const RecordedSignal& signal : data.signals) {
    if (signal.of_joint || signal.column == "t_s" || signal.column == "row") continue;
    ++columns;
    Limit one = BestLimitOf(signal, poses);
    if (one.p_value < best.p_value) best = std::move(one);
  }
  if (!(columns * best.p_value <= kConditionSignificance)) return std::nullopt;
  LargerUnderCondition found;
  found.condition = best.condition;
  found.of_poses = static_cast<int>(poses.size());
  std::vector<double> these, others;
  bool before = false;
  for (const RankedPose& pose : poses) {
    const bool meets = Meets(found.condition, data, pose.row);
    (meets ? these : others).push_back(pose.size);
    if (meets && !before) ++found.stretches;
    if (meets && found.poses == 0) found.first = pose.row;
    if (meets) {
      found.last = pose.row;
      ++found.poses;
    }
    before = meets;
  }
  found.ratio = MedianRatio(std::move(these), std::move(others));
  if (!(found.ratio >= kMinRatio)) return std::nullopt;
  return found;
}

std::optional<LargerResiduals> LargerInSomeStretch(const Dataset& data,
                                                   const PerRow<double>& sizes) {
  if (!data.table.recorded.order) return std::nullopt;
  const std::vector<RankedPose> poses = RankedPoses(data, sizes);
  const std::size_t n = poses.size();
  std::vector<double> sums(n + 1, 0.0);
  for (std::size_t k = 0; k < n; ++k) sums[k + 1] = sums[k] + poses[k].rank;
  double largest = -HUGE_VAL, trials = 0;
  std::size_t from = 0, end = 0;
  for (std::size_t first = 0; first < n; ++first) {
    for (std::size_t last = first + kMinPoses; last <= std::min(n, first + n / 2); ++last) {
      ++trials;
      const double z = Standardised(sums[last] - sums[first], last - first, n);
      if (z <= largest) continue;
      largest = z;
      from = first;
      end = last;
    }
  }
  if (trials == 0 || trials * NormalTail(largest) > kConditionSignificance) return std::nullopt;
  std::vector<double> these, others;
  for (std::size_t k = 0; k < n; ++k)
    (k >= from && k < end ? these : others).push_back(poses[k].size);
  LargerResiduals found{static_cast<int>(end - from), static_cast<int>(n), 0, poses[from].row,
                        poses[end - 1].row};
  found.ratio = MedianRatio(std::move(these), std::move(others));
  if (!(found.ratio >= kMinRatio)) return std::nullopt;
  return found;
}

}  // namespace plumbline::diagnosis
