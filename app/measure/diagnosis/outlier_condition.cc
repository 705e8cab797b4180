#include "app/measure/diagnosis/outlier_condition.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "app/measure/diagnosis/thresholds.h"

namespace plumbline::measure {
namespace {

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

/// The best limit of a recorded signal that separates rejected rows; not of joints or time.
std::optional<OutlierCondition> LimitOf(const Dataset& data, const std::vector<RowIndex>& counted,
                                        const PerRow<bool>& rejected, int count) {
  LimitSearch search(static_cast<int>(counted.size()), count);
  for (const RecordedSignal& signal : data.signals) {
    if (signal.of_joint || signal.column == "t_s" || signal.column == "row") continue;
    std::vector<SignalRow> rows;
    rows.reserve(counted.size());
    for (const RowIndex row : counted) rows.push_back({signal.values[row], rejected[row]});
    std::sort(rows.begin(), rows.end(),
              [](const SignalRow& a, const SignalRow& b) { return a.value < b.value; });
    search.Try(signal.column, false, rows);
    std::reverse(rows.begin(), rows.end());
    search.Try(signal.column, true, rows);
  }
  return search.Best();
}

std::string NumberText(const std::optional<int>& number) {
  return number ? std::to_string(*number) : std::string();
}

}  // namespace

std::optional<OutlierCondition> ConditionOfOutliers(const Dataset& data,
                                                    const PerRow<double>& weights) {
  PerRow<bool> rejected(weights.size(), false);
  for (const RowIndex row : weights.indices()) rejected[row] = weights[row] < kOutlierWeight;
  auto of_artefact = NameOfOutliers(data, rejected, "artefact", [&](RowIndex row) {
    const Observation& of = data.observations[row];
    return OnArtefact(of.kind) ? data.cell.artefacts[of.artefact.offset()].name : std::string();
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
  const auto runs = static_cast<int>(
      std::count_if(counted.begin(), counted.end(), [&](RowIndex row) { return rejected[row]; }));
  if (runs < kMinRuns) return std::nullopt;
  return LimitOf(data, counted, rejected, runs);
}

bool Meets(const RowCondition& condition, const Dataset& data, RowIndex row) {
  if (condition.name.empty()) {
    for (const RecordedSignal& signal : data.signals) {
      if (signal.column != condition.column) continue;
      const double value = signal.values[row];
      return condition.above ? value >= condition.limit : value <= condition.limit;
    }
  }
  if (condition.column == "tool")
    return NumberText(data.measured(row).tool_number) == condition.name;
  return condition.column == "payload_item" &&
         NumberText(data.measured(row).payload_item) == condition.name;
}

}  // namespace plumbline::measure
