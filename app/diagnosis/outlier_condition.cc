#include "app/diagnosis/outlier_condition.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "app/diagnosis/thresholds.h"

namespace plumbline::diagnosis {
namespace {

constexpr int kMinRejected = 3;

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

struct SignalRow {
  double value = 0;
  bool rejected = false;
};

struct Candidate {
  OutlierCondition condition;
  double p_value = 1;
};

/// Tries every limit with fewer than twice as many rows beyond it as there are rejected rows.
class LimitSearch {
 public:
  LimitSearch(int rows, int rejected) : rows_(rows), rejected_(rejected) {}

  /// @param sorted  from the side on which the limit is
  void Try(const std::string& column, bool above, const std::vector<SignalRow>& sorted) {
    int inside = 0, rejected_inside = 0;
    for (std::size_t k = 0; k + 1 < sorted.size() && inside + 1 < 2 * rejected_; ++k) {
      ++inside;
      rejected_inside += sorted[k].rejected ? 1 : 0;
      if (sorted[k].value == sorted[k + 1].value) continue;
      ++trials_;
      if (inside >= 2 * rejected_inside) continue;
      const double p = HypergeometricTail(rows_, rejected_, inside, rejected_inside);
      if (p < best_.p_value) {
        best_ = {{column, sorted[k].value, above, inside, rejected_inside}, p};
      }
    }
  }

  std::optional<OutlierCondition> Best() const {
    if (trials_ * best_.p_value > kConditionSignificance) return std::nullopt;
    return best_.condition;
  }

 private:
  int rows_, rejected_;
  double trials_ = 0;
  Candidate best_;
};

}  // namespace

std::optional<OutlierCondition> ConditionOfOutliers(const Dataset& data,
                                                    const PerRow<double>& weights) {
  const auto is_rejected = [](double weight) { return weight < kOutlierWeight; };
  const auto rejected =
      static_cast<int>(std::count_if(weights.begin(), weights.end(), is_rejected));
  if (rejected < kMinRejected) return std::nullopt;
  LimitSearch search(data.rows(), rejected);
  for (const RecordedSignal& signal : data.signals) {
    if (signal.of_joint || signal.column == "t_s" || signal.column == "row") continue;
    std::vector<SignalRow> rows;
    for (const RowIndex row : data.row_indices()) {
      rows.push_back({signal.values[row], is_rejected(weights[row])});
    }
    std::sort(rows.begin(), rows.end(),
              [](const SignalRow& a, const SignalRow& b) { return a.value < b.value; });
    search.Try(signal.column, false, rows);
    std::reverse(rows.begin(), rows.end());
    search.Try(signal.column, true, rows);
  }
  return search.Best();
}

}  // namespace plumbline::diagnosis
