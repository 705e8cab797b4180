#include "app/measure/diagnosis/critics/misfit.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <utility>
#include <vector>

#include "app/measure/diagnosis/data/thresholds.h"
#include "firmware-like/statistics/statistics.h"

namespace plumbline::measure {
namespace {

bool IsBeyond(const RowCondition& limit, double value) {
  return limit.above ? value >= limit.limit : value <= limit.limit;
}

std::string NumberText(const std::optional<int>& number) {
  return number ? std::to_string(*number) : std::string();
}

// Rejected rows.

constexpr int kMinRuns = 3;

double LogChoose(int n, int k) {
  return std::lgamma(n + 1.0) - std::lgamma(k + 1.0) - std::lgamma(n - k + 1.0);
}

/// P(X >= x) if m of n rows are rejected and X of them are among k rows chosen at random.
double HypergeometricTail(int n, int m, int k, int x) {
  double tail = 0;
  for (int i = x; i <= std::min(m, k); ++i) {
    if (m - i > n - k) continue;
    tail += std::exp(LogChoose(k, i) + LogChoose(n - k, m - i) - LogChoose(n, m));
  }
  return tail;
}

/// The rows that count: one accepted and one rejected visit of each pose, and of each run of
/// rejected rows the first.
std::vector<RowIndex> CountedRows(const Dataset& data, const PerRow<bool>& rejected) {
  constexpr int kMaxGap = 2;
  std::vector<RowIndex> counted;
  std::set<std::pair<ClusterIndex, bool>> visited;
  int last = -kMaxGap - 2;
  for (const RowIndex row : data.row_indices()) {
    const bool continues = rejected[row] && row.value() - last <= kMaxGap + 1;
    if (rejected[row]) last = row.value();
    const bool fresh = visited.emplace(data.cluster_of[row], rejected[row]).second;
    if (fresh && !continues) counted.push_back(row);
  }
  return counted;
}

struct SignalRow {
  double value = 0;
  bool rejected = false;
};

struct Candidate {
  OutlierCondition condition;
  double p_value = 1;
};

/// Rows beyond a limit for one rejected row among them, at most: where the noise is larger, most
/// rows still pass.
constexpr int kMostInside = 4;

/// Tries every limit with fewer than `kMostInside` times as many rows beyond it as there are
/// rejected rows.
class LimitSearch {
 public:
  LimitSearch(int rows, int rejected) : rows_(rows), rejected_(rejected) {}

  /// @param sorted  from the side on which the limit is
  void Try(const std::string& column, bool above, const std::vector<SignalRow>& sorted) {
    int inside = 0, rejected_inside = 0;
    for (std::size_t k = 0; k + 1 < sorted.size() && inside + 1 < kMostInside * rejected_; ++k) {
      ++inside;
      rejected_inside += sorted[k].rejected ? 1 : 0;
      if (sorted[k].value == sorted[k + 1].value) continue;
      ++trials_;
      if (inside >= kMostInside * rejected_inside) continue;
      const double p = HypergeometricTail(rows_, rejected_, inside, rejected_inside);
      if (!best_ || p < best_->p_value) {
        best_ = Candidate{{{column, "", sorted[k].value, above}, inside, rejected_inside}, p};
      }
    }
  }

  std::optional<OutlierCondition> Best() const {
    if (!best_ || trials_ * best_->p_value > kConditionSignificance) return std::nullopt;
    return best_->condition;
  }

 private:
  int rows_, rejected_;
  double trials_ = 0;
  std::optional<Candidate> best_;
};

/// The only name of all rejected rows, if chance does not explain that.
/// @param name_of  empty for rows without a name in this column
/// @param mostly   also at least half of the rows with that name are rejected
template <typename NameOf>
std::optional<OutlierCondition> NameOfOutliers(const Dataset& data, const PerRow<bool>& rejected,
                                               const char* column, const NameOf& name_of,
                                               bool mostly = false) {
  std::map<std::string, int> rows;
  std::set<std::string> of_rejected;
  int count = 0;
  for (const RowIndex row : data.row_indices()) {
    const std::string name = name_of(row);
    ++rows[name];
    if (!rejected[row]) continue;
    of_rejected.insert(name);
    ++count;
  }
  if (of_rejected.size() != 1 || of_rejected.begin()->empty() || rows.size() < 2)
    return std::nullopt;
  const int own = rows[*of_rejected.begin()];
  if (mostly && 2 * count < own) return std::nullopt;
  const double p = HypergeometricTail(data.rows(), count, own, count);
  if (p * static_cast<double>(rows.size()) > kConditionSignificance) return std::nullopt;
  return OutlierCondition{{column, *of_rejected.begin(), 0, true}, own, count};
}

/// The best limit that separates rejected rows, of a recorded signal or one of these quantities.
std::optional<OutlierCondition> LimitOf(const Dataset& data, const std::vector<RowQuantity>& more,
                                        const std::vector<RowIndex>& counted,
                                        const PerRow<bool>& rejected, int count) {
  LimitSearch search(static_cast<int>(counted.size()), count);
  const auto try_limits = [&](const std::string& column, const PerRow<double>& values) {
    std::vector<SignalRow> rows;
    rows.reserve(counted.size());
    for (const RowIndex row : counted) rows.push_back({values[row], rejected[row]});
    std::ranges::sort(rows,
                      [](const SignalRow& a, const SignalRow& b) { return a.value < b.value; });
    search.Try(column, false, rows);
    std::ranges::reverse(rows);
    search.Try(column, true, rows);
  };
  for (const RecordedSignal& signal : data.signals) try_limits(signal.column, signal.values);
  for (const RowQuantity& quantity : more) try_limits(quantity.column, quantity.values);
  return search.Best();
}

// Larger residuals.

constexpr int kMinPoses = 3;
// Points whose errors are half as large again hold a 95 % radius in about 70 %.
constexpr double kMinRatio = 1.5;

/// A pose with the mean size of its visits, and the rank of that size, from 1.
struct RankedPose {
  std::vector<RowIndex> visits;
  double size = 0;
  double rank = 0;
};

/// Sets sizes and ranks; equal sizes have their mean rank.
void Rank(const PerRow<double>& sizes, std::vector<RankedPose>& poses) {
  for (RankedPose& pose : poses) {
    for (const RowIndex row : pose.visits) pose.size += sizes[row];
    pose.size /= static_cast<double>(pose.visits.size());
  }
  std::vector<std::size_t> order(poses.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order,
                    [&](std::size_t a, std::size_t b) { return poses[a].size < poses[b].size; });
  for (std::size_t first = 0; first < order.size();) {
    std::size_t end = first + 1;
    while (end < order.size() && poses[order[end]].size == poses[order[first]].size) ++end;
    for (std::size_t k = first; k < end; ++k)
      poses[order[k]].rank = 0.5 * static_cast<double>(first + 1 + end);
    first = end;
  }
}

/// Every pose once, in the order of first visits.
std::vector<RankedPose> RankedPoses(const Dataset& data, const PerRow<double>& sizes) {
  std::map<ClusterIndex, std::size_t> places;
  std::vector<RankedPose> poses;
  for (const RowIndex row : data.row_indices()) {
    if (data.numbers[row].count == 0) continue;
    const auto [place, is_new] = places.emplace(data.cluster_of[row], poses.size());
    if (is_new) poses.emplace_back();
    poses[place->second].visits.push_back(row);
  }
  Rank(sizes, poses);
  return poses;
}

/// The poses in the order of the file, one for all successive visits.
std::vector<RankedPose> SuccessivePoses(const Dataset& data, const PerRow<double>& sizes) {
  std::vector<RankedPose> poses;
  for (const RowIndex row : data.row_indices()) {
    if (data.numbers[row].count == 0) continue;
    const bool continues =
        !poses.empty() && data.cluster_of[poses.back().visits.back()] == data.cluster_of[row];
    if (!continues) poses.emplace_back();
    poses.back().visits.push_back(row);
  }
  Rank(sizes, poses);
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

/// Ratio of the medians; 0 if it does not exist.
double MedianRatio(std::vector<double> inside, std::vector<double> outside) {
  if (inside.empty() || outside.empty()) return 0;
  const double of_outside = statistics::MedianOf(outside);
  return of_outside > 0 ? statistics::MedianOf(inside) / of_outside : 0;
}

/// A limit, and the probability of the residuals beyond it, multiplied by the number of limits
/// tried.
struct Limit {
  RowCondition condition;
  double p_value = HUGE_VAL;
};

double MeanOf(const RecordedSignal& signal, const RankedPose& pose) {
  double sum = 0;
  for (const RowIndex row : pose.visits) sum += signal.values[row];
  return sum / static_cast<double>(pose.visits.size());
}

/// The best limit of one signal, from above or below.
Limit BestLimitOf(const RecordedSignal& signal, const std::vector<RankedPose>& poses) {
  std::vector<std::pair<double, double>> values;  // of the signal, with the rank
  values.reserve(poses.size());
  for (const RankedPose& pose : poses) values.emplace_back(MeanOf(signal, pose), pose.rank);
  std::ranges::sort(values);
  Limit best;
  double largest = -HUGE_VAL;
  int trials = 0;
  for (const bool above : {false, true}) {
    if (above) std::ranges::reverse(values);
    double sum = 0;
    for (std::size_t k = 0; k + kMinPoses < values.size(); ++k) {
      sum += values[k].second;
      if (k + 1 < kMinPoses || values[k].first == values[k + 1].first) continue;
      ++trials;
      const double z = Standardised(sum, k + 1, values.size());
      if (z <= largest) continue;
      largest = z;
      best.condition = {signal.column, "", values[k].first, above};
    }
  }
  if (trials > 0) best.p_value = trials * NormalTail(largest);
  return best;
}

LargerUnderCondition DescriptionOf(const Dataset& data, const RecordedSignal& signal,
                                   const std::vector<RankedPose>& poses,
                                   const RowCondition& condition) {
  LargerUnderCondition found;
  found.condition = condition;
  found.of_poses = static_cast<int>(poses.size());
  std::vector<double> inside, outside;
  for (const RankedPose& pose : poses) {
    (IsBeyond(condition, MeanOf(signal, pose)) ? inside : outside).push_back(pose.size);
  }
  found.poses = static_cast<int>(inside.size());
  found.ratio = MedianRatio(std::move(inside), std::move(outside));
  bool before = false;
  for (const RowIndex row : data.row_indices()) {
    if (data.numbers[row].count == 0) continue;
    const bool meets = Meets(condition, data, row);
    if (meets && !before && found.stretches++ == 0) found.first = row;
    if (meets) found.last = row;
    before = meets;
  }
  return found;
}

}  // namespace

bool Meets(const RowCondition& condition, const Dataset& data, RowIndex row) {
  if (condition.name.empty()) {
    for (const RecordedSignal& signal : data.signals) {
      if (signal.column != condition.column) continue;
      return IsBeyond(condition, signal.values[row]);
    }
  }
  if (condition.column == "tool")
    return NumberText(data.measured(row).tool_number) == condition.name;
  return condition.column == "payload_item" &&
         NumberText(data.measured(row).payload_item) == condition.name;
}

std::vector<RowQuantity> GravityLoadsAt(const Dataset& data, const Linearisation& linear) {
  using Entries = effects::Influence<double>;
  constexpr double kLeastLever_m = 1e-6;  // with less, the torque of a joint moves no tip
  std::vector<RowQuantity> loads;
  for (int joint = 0; joint < data.cell.robot.size(); ++joint) {
    if (data.cell.robot.joints[joint].type != model::JointType::kRevolute) continue;
    const int turn = Entries::kTurn * model::kMaxJoints + joint;
    const int compliance = Entries::kCompliance * model::kMaxJoints + joint;
    PerRow<double> torque, size;
    for (const RowIndex row : data.row_indices()) {
      const Gradient& gradient = linear.gradients[row];
      const double square = gradient.col(turn).squaredNorm();
      torque.push_back(square > kLeastLever_m * kLeastLever_m
                           ? gradient.col(compliance).dot(gradient.col(turn)) / square
                           : 0);
      size.push_back(std::abs(torque[row]));
    }
    loads.push_back({fmt::format("tau{}_Nm", joint + 1), std::move(torque)});
    loads.push_back({fmt::format("|tau{}_Nm|", joint + 1), std::move(size)});
  }
  PerRow<double> about_x, about_y;
  for (const RowIndex row : data.row_indices()) {
    const Gradient& gradient = linear.gradients[row];
    const Eigen::Vector2d moment = gradient.middleCols<2>(Entries::kBaseTilt)
                                       .completeOrthogonalDecomposition()
                                       .solve(gradient.col(Entries::kPedestalCompliance));
    about_x.push_back(moment.x());
    about_y.push_back(moment.y());
  }
  loads.push_back({"base_moment_x_Nm", std::move(about_x)});
  loads.push_back({"base_moment_y_Nm", std::move(about_y)});
  return loads;
}

std::string DriverOf(std::string quantity) {
  std::erase(quantity, '|');
  return quantity;
}

std::optional<OutlierCondition> ConditionOfOutliers(const Dataset& data,
                                                    const PerRow<double>& weights,
                                                    const std::vector<RowQuantity>& more) {
  PerRow<bool> rejected(weights.size(), false);
  for (const RowIndex row : weights.indices()) rejected[row] = weights[row] < kOutlierWeight;
  auto of_artefact = NameOfOutliers(data, rejected, "artefact", [&](RowIndex row) {
    const Observation& observation = data.observations[row];
    return OnArtefact(observation.kind) ? data.cell.artefacts[observation.artefact.offset()].name
                                        : std::string();
  });
  if (of_artefact) return of_artefact;
  auto of_camera = NameOfOutliers(data, rejected, "camera",
                                  [&](RowIndex row) { return data.measured(row).camera; });
  if (of_camera) return of_camera;
  // A few misread rows may be in one session by chance: at least half of its rows must be rejected.
  const auto mostly = [&](const char* column, const auto& name_of) {
    return NameOfOutliers(data, rejected, column, name_of, true);
  };
  for (const auto& found :
       {mostly("tool", [&](RowIndex row) { return NumberText(data.measured(row).tool_number); }),
        mostly("payload_item",
               [&](RowIndex row) { return NumberText(data.measured(row).payload_item); }),
        mostly("session", [&](RowIndex row) { return data.sessions[data.session_of[row]]; }),
        mostly("kind",
               [&](RowIndex row) { return std::string(Describe(data.observations[row].kind)); })}) {
    if (found) return found;
  }
  const std::vector<RowIndex> counted = CountedRows(data, rejected);
  const auto runs =
      static_cast<int>(std::ranges::count_if(counted, [&](RowIndex row) { return rejected[row]; }));
  if (runs < kMinRuns) return std::nullopt;
  return LimitOf(data, more, counted, rejected, runs);
}

std::optional<LargerUnderCondition> FindLargerUnderCondition(const Dataset& data,
                                                             const PerRow<double>& sizes) {
  const std::vector<RankedPose> poses = RankedPoses(data, sizes);
  const auto tested = [](const RecordedSignal& signal) {
    return !signal.of_joint && signal.column != "t_s" && signal.column != "row";
  };
  const auto columns = std::ranges::count_if(data.signals, tested);
  std::optional<LargerUnderCondition> best;
  for (const RecordedSignal& signal : data.signals) {
    if (!tested(signal)) continue;
    const Limit limit = BestLimitOf(signal, poses);
    const double p_value = static_cast<double>(columns) * limit.p_value;
    if (!(p_value <= kConditionSignificance)) continue;
    LargerUnderCondition found = DescriptionOf(data, signal, poses, limit.condition);
    found.p_value = p_value;
    if (!(found.ratio >= kMinRatio)) continue;
    const bool repeated = found.stretches >= kMinStretches;
    const bool best_repeated = best && best->stretches >= kMinStretches;
    if (best && (best_repeated != repeated ? best_repeated : best->p_value <= p_value)) continue;
    best = std::move(found);
  }
  return best;
}

std::optional<LargerResiduals> FindLargerForAWhile(const Dataset& data,
                                                   const PerRow<double>& sizes) {
  if (!data.table.recorded.order) return std::nullopt;
  const std::vector<RankedPose> poses = SuccessivePoses(data, sizes);
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
  const double p_value = trials > 0 ? trials * NormalTail(largest) : 1;
  if (!(p_value <= kConditionSignificance)) return std::nullopt;
  std::vector<double> inside, outside;
  for (std::size_t k = 0; k < n; ++k)
    (k >= from && k < end ? inside : outside).push_back(poses[k].size);
  LargerResiduals found{static_cast<int>(end - from), static_cast<int>(n),          0,
                        poses[from].visits.front(),   poses[end - 1].visits.back(), p_value};
  found.ratio = MedianRatio(std::move(inside), std::move(outside));
  if (!(found.ratio >= kMinRatio)) return std::nullopt;
  return found;
}

}  // namespace plumbline::measure
