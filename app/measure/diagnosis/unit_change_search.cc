#include "app/measure/diagnosis/unit_change_search.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/measure/diagnosis/alignment.h"
#include "app/measure/diagnosis/gross_errors.h"
#include "app/measure/diagnosis/thresholds.h"
#include "app/measure/diagnosis/unit_segment.h"
#include "firmware-like/statistics/statistics.h"

namespace plumbline::measure {
namespace {

constexpr int kMaxTrialRows =
    120;  // used to locate the change roughly; all rows around it locate it exactly

/// Maximum likelihood change point of the mean and variance of a column's numbers, taken as normal:
/// minimises n_1 ln s_1^2 + n_2 ln s_2^2.
std::optional<RowIndex> ChangePoint(const Dataset& data, const OtherUnit& other) {
  const int rows = data.rows();
  if (rows < 2 * kMinRowsPerSide) return std::nullopt;
  std::vector<double> costs(static_cast<std::size_t>(rows) + 1, 0.0);
  for (const auto& number : other.numbers) {
    std::vector<double> sum = {0}, squares = {0};
    double largest = 0;
    for (const MeasuredRow& row : data.table.rows)
      largest = std::max(largest, std::abs(number(row)));
    if (largest == 0) continue;
    for (const MeasuredRow& row : data.table.rows) {
      const double value = number(row) / largest;
      sum.push_back(sum.back() + value);
      squares.push_back(squares.back() + value * value);
    }
    const auto part = [&](std::size_t first, std::size_t last) {
      constexpr double kRounding = 1e-10;  // of a variance, relative to the largest square
      const auto n = static_cast<double>(last - first);
      const double mean = (sum[last] - sum[first]) / n;
      const double variance = (squares[last] - squares[first]) / n - mean * mean;
      return n * std::log(std::max(variance, 0.0) + kRounding);
    };
    const auto end = static_cast<std::size_t>(rows);
    for (std::size_t k = kMinRowsPerSide; k + kMinRowsPerSide <= end; ++k) {
      costs[k] += part(0, k) + part(k, end);
    }
  }
  const auto first = costs.begin() + kMinRowsPerSide, last = costs.end() - kMinRowsPerSide;
  return RowIndex(std::min_element(first, last) - costs.begin());
}

/// Distance of each measured point from the predicted one [m]; infinite if the deflected posture
/// does not converge.
PerRow<double> DistancesAt(const Dataset& data, const Model& model) {
  const ModelAtRows at_rows(data, model);
  PerRow<double> distances;
  deflection::Sensitivity scratch;
  LinearRow at;
  Gradient none;
  for (const RowIndex row : data.row_indices()) {
    const bool settled = at_rows.At(row, {}, scratch, at, none);
    const double distance = settled ? LengthsOf(at.residual).norm() : HUGE_VAL;
    distances.push_back(std::isfinite(distance) ? distance : HUGE_VAL);
  }
  return distances;
}

double LossOf(double distance_m) {
  return std::min(distance_m, kGross_m);
}

/// The segment on one side with the smallest loss under a model; of equal ones the shortest, so
/// that converting the row at its end reduces the loss.
RowSegment SegmentOfLeastLoss(const Dataset& data, const OtherUnit& other, const Model& model,
                              bool from) {
  Dataset converted = data;
  for (const RowIndex row : data.row_indices()) other.convert(converted, row);
  const PerRow<double> as_read = DistancesAt(data, model);
  const PerRow<double> as_converted = DistancesAt(converted, model);
  double gain = 0, most = 0;  // reduction of the loss by converting the rows so far
  RowSegment best{RowIndex(from ? data.rows() : 0), from};
  const auto update = [&](RowIndex change) {
    if (!(gain > most + 1e-9 * kGross_m)) return;
    most = gain;
    best.change = change;
  };
  if (from) {
    for (int k = data.rows(); k-- > 0;) {
      const RowIndex row(k);
      gain += LossOf(as_read[row]) - LossOf(as_converted[row]);
      update(row);
    }
  } else {
    for (const RowIndex row : data.row_indices()) {
      gain += LossOf(as_read[row]) - LossOf(as_converted[row]);
      update(RowIndex(row.value() + 1));
    }
  }
  return best;
}

/// A unit change and the errors with it corrected.
struct UnitTrial {
  const OtherUnit* other = nullptr;
  LineSegment lines;
  int changed = 0;                   ///< number of converted rows
  double before_m = 0, after_m = 0;  ///< median distance of those rows
  double loss_m = HUGE_VAL;          ///< mean over all rows
};

class UnitChangeSearch {
 public:
  UnitChangeSearch(const Dataset& data, int threads)
      : data_(data),
        subset_(SelectRows(data, EvenlySpacedRows(data, kMaxTrialRows))),
        threads_(threads) {
    const Result<Model> model = Align(subset_, Model::Declared(subset_), threads_);
    if (model) {
      as_read_ = DistancesAt(subset_, *model);
    } else {
      as_read_.assign(subset_.rows(), HUGE_VAL);
    }
  }

  bool HasGrossRows() const {
    return std::ranges::count_if(as_read_, [](double distance_m) {
             return distance_m >= kGross_m;
           }) >= kMinRowsPerSide;
  }

  std::optional<UnitTrial> Best() const {
    std::optional<UnitTrial> best;
    for (const OtherUnit& other : others_) {
      for (const bool from : {true, false}) {
        const std::optional<UnitTrial> trial = RunTrial(other, from);
        if (trial && (!best || trial->loss_m < best->loss_m)) best = trial;
      }
    }
    return best;
  }

 private:
  std::optional<UnitTrial> RunTrial(const OtherUnit& other, bool from) const;
  /// Nothing if the change does not explain the gross errors.
  /// @param distances  of the subset's rows with the change corrected
  std::optional<UnitTrial> Judge(const OtherUnit& other, const RowSegment& segment,
                                 const Model& model, const PerRow<double>& distances) const;
  LineSegment ExactLines(const OtherUnit& other, const RowSegment& segment,
                         const Model& model) const;

  const Dataset& data_;
  Dataset subset_;
  int threads_;
  PerRow<double> as_read_;
  std::vector<OtherUnit> others_ = OtherUnits(data_);
};

/// Locates the change exactly among all rows around its position in the subset.
LineSegment UnitChangeSearch::ExactLines(const OtherUnit& other, const RowSegment& segment,
                                         const Model& model) const {
  const int before = std::max(0, segment.change.value() - 2);
  const int after = std::min(subset_.rows() - 1, segment.change.value() + 1);
  const int first_line = subset_.measured(RowIndex(before)).line;
  const int last_line = subset_.measured(RowIndex(after)).line;
  FitRows around;
  for (const RowIndex row : data_.row_indices()) {
    const int line = data_.measured(row).line;
    if (line >= first_line && line <= last_line) around.push_back(row);
  }
  const Dataset rows = SelectRows(data_, around);
  const RowSegment exact = SegmentOfLeastLoss(rows, other, model, segment.from);
  const int changed = exact.Count(rows.rows());
  return changed > 0 ? LinesOf(rows, exact) : LinesOf(subset_, segment);
}

std::optional<UnitTrial> UnitChangeSearch::RunTrial(const OtherUnit& other, bool from) const {
  const std::optional<RowIndex> start = ChangePoint(subset_, other);
  if (!start) return std::nullopt;
  RowSegment segment{*start, from};
  Model model = Model::Declared(subset_);
  PerRow<double> distances;
  constexpr int kRounds = 3;  // of frames given the change, and the change given the frames
  for (int round = 0; round < kRounds; ++round) {
    Dataset changed = subset_;
    Convert(other, LinesOf(subset_, segment), changed);
    const Result<Model> aligned = Align(changed, Model::Declared(changed), threads_);
    if (!aligned) return std::nullopt;
    model = *aligned;
    distances = DistancesAt(changed, model);
    const RowSegment better = SegmentOfLeastLoss(subset_, other, model, from);
    if (!better.IsLong(subset_.rows())) return std::nullopt;
    if (better.change == segment.change) break;
    segment = better;
  }
  return Judge(other, segment, model, distances);
}

std::optional<UnitTrial> UnitChangeSearch::Judge(const OtherUnit& other, const RowSegment& segment,
                                                 const Model& model,
                                                 const PerRow<double>& distances) const {
  UnitTrial trial{&other, ExactLines(other, segment, model), segment.Count(subset_.rows()), 0, 0,
                  0};
  std::vector<double> before, after;
  int gross = 0;
  for (const RowIndex row : subset_.row_indices()) {
    gross += distances[row] >= kGross_m ? 1 : 0;
    trial.loss_m += LossOf(distances[row]) / subset_.rows();
    if (!segment.Contains(row)) continue;
    before.push_back(as_read_[row]);
    after.push_back(distances[row]);
  }
  trial.before_m = statistics::MedianOf(before);
  trial.after_m = statistics::MedianOf(after);
  const bool explains = trial.before_m >= kGross_m &&
                        trial.after_m < kExplainedRatio * trial.before_m &&
                        gross <= kMaxOutliers * subset_.rows();
  return explains ? std::optional(trial) : std::nullopt;
}

}  // namespace

std::optional<std::string> ChangedUnit(const Dataset& data, int threads) {
  const UnitChangeSearch search(data, threads);
  if (!search.HasGrossRows()) return std::nullopt;
  const std::optional<UnitTrial> found = search.Best();
  if (!found) return std::nullopt;
  const std::string as_read =
      std::isfinite(found->before_m)
          ? fmt::format(
                "as read, measured points in these rows are {:.0f} mm from the positions predicted "
                "by the declared cell (median)",
                1e3 * found->before_m)
          : std::string("as read, the posture of the arm in these rows cannot be computed");
  return fmt::format(
      "{} hold{} {} {}: {}; converted to {}, the distance is {:.2f} mm. Write {} in every row",
      found->other->columns, found->other->numbers.size() > 1 ? "" : "s", found->other->unit,
      found->lines.Phrase(), as_read, found->other->declared, 1e3 * found->after_m,
      found->other->declared);
}

}  // namespace plumbline::measure
