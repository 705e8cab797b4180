#include "app/diagnosis/unit_changes.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "app/diagnosis/alignment.h"
#include "app/diagnosis/column_units.h"
#include "app/diagnosis/gross_errors.h"
#include "app/diagnosis/thresholds.h"
#include "firmware-like/geometry/angle.h"
#include "firmware-like/statistics/median.h"

namespace plumbline::diagnosis {
namespace {

constexpr int kMaxRows =
    120;  // used to locate the change roughly; all rows around it locate it exactly
constexpr int kMinRowsPerSide = 4;  // fewer are single wrong rows instead of another unit
constexpr double kMinContrast = 5;  // minimum ratio of the largest angle to one turn in radians

/// The rows from a change on, or those before it.
struct Segment {
  RowIndex change;
  bool from = true;

  bool Contains(RowIndex row) const { return from == (row >= change); }
  int Count(int rows) const { return from ? rows - change.value() : change.value(); }
};

/// A segment by its line in the file, which is independent of thinning.
struct Lines {
  int line = 0;  ///< first line (if `from`) or last line of the segment
  bool from = true;

  bool Contains(const table::MeasuredRow& row) const {
    return from ? row.line >= line : row.line <= line;
  }
  std::string Text() const { return fmt::format("{} line {}", from ? "from" : "up to", line); }
  std::string Phrase() const { return from ? Text() + " on" : Text(); }
};

Lines LinesOf(const Dataset& data, const Segment& segment) {
  const RowIndex row = segment.from ? segment.change : RowIndex(segment.change.value() - 1);
  return {data.measured(row).line, segment.from};
}

/// True if both sides of the change are long enough.
bool IsLong(const Segment& segment, int rows) {
  const int change = segment.change.value();
  return change >= kMinRowsPerSide && rows - change >= kMinRowsPerSide;
}

void Convert(const OtherUnit& other, const Lines& lines, Dataset& data) {
  for (const RowIndex row : data.row_indices()) {
    if (lines.Contains(data.measured(row))) other.convert(data, row);
  }
}

/// Maximum likelihood change point of the mean and variance of a column's numbers, taken as normal:
/// minimises n_1 ln s_1^2 + n_2 ln s_2^2.
std::optional<RowIndex> ChangePoint(const Dataset& data, const OtherUnit& other) {
  const int rows = data.rows();
  if (rows < 2 * kMinRowsPerSide) return std::nullopt;
  std::vector<double> costs(static_cast<std::size_t>(rows) + 1, 0.0);
  for (const auto& number : other.numbers) {
    std::vector<double> sum = {0}, squares = {0};
    double largest = 0;
    for (const table::MeasuredRow& row : data.table.rows)
      largest = std::max(largest, std::abs(number(row)));
    if (largest == 0) continue;
    for (const table::MeasuredRow& row : data.table.rows) {
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
Segment SegmentOfLeastLoss(const Dataset& data, const OtherUnit& other, const Model& model,
                           bool from) {
  Dataset converted = data;
  for (const RowIndex row : data.row_indices()) other.convert(converted, row);
  const PerRow<double> as_read = DistancesAt(data, model);
  const PerRow<double> as_converted = DistancesAt(converted, model);
  double gain = 0, most = 0;  // reduction of the loss by converting the rows so far
  Segment best{RowIndex(from ? data.rows() : 0), from};
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
struct Trial {
  const OtherUnit* other = nullptr;
  Lines lines;
  int changed = 0;                   ///< number of converted rows
  double before_m = 0, after_m = 0;  ///< median distance of those rows
  double loss_m = HUGE_VAL;          ///< mean over all rows
};

class UnitChangeSearch {
 public:
  UnitChangeSearch(const Dataset& data, int threads)
      : data_(data),
        subset_(SelectRows(data, EvenlySpacedRows(data, kMaxRows))),
        threads_(threads) {
    const Result<Model> model = Align(subset_, Model::Declared(subset_), threads_);
    if (model) {
      as_read_ = DistancesAt(subset_, *model);
    } else {
      as_read_.assign(static_cast<std::size_t>(subset_.rows()), HUGE_VAL);
    }
  }

  bool HasGrossRows() const {
    return std::count_if(as_read_.begin(), as_read_.end(), [](double distance_m) {
             return distance_m >= kGross_m;
           }) >= kMinRowsPerSide;
  }

  std::optional<Trial> Best() const {
    std::optional<Trial> best;
    for (const OtherUnit& other : others_) {
      for (const bool from : {true, false}) {
        const std::optional<Trial> trial = RunTrial(other, from);
        if (trial && (!best || trial->loss_m < best->loss_m)) best = trial;
      }
    }
    return best;
  }

 private:
  std::optional<Trial> RunTrial(const OtherUnit& other, bool from) const;
  Lines ExactLines(const OtherUnit& other, const Segment& segment, const Model& model) const;

  const Dataset& data_;
  Dataset subset_;
  int threads_;
  PerRow<double> as_read_;
  std::vector<OtherUnit> others_ = OtherUnits(data_);
};

/// Locates the change exactly among all rows around its position in the subset.
Lines UnitChangeSearch::ExactLines(const OtherUnit& other, const Segment& segment,
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
  const Segment exact = SegmentOfLeastLoss(rows, other, model, segment.from);
  const int changed = exact.Count(rows.rows());
  return changed > 0 ? LinesOf(rows, exact) : LinesOf(subset_, segment);
}

std::optional<Trial> UnitChangeSearch::RunTrial(const OtherUnit& other, bool from) const {
  const std::optional<RowIndex> start = ChangePoint(subset_, other);
  if (!start) return std::nullopt;
  Segment segment{*start, from};
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
    const Segment better = SegmentOfLeastLoss(subset_, other, model, from);
    if (!IsLong(better, subset_.rows())) return std::nullopt;
    if (better.change == segment.change) break;
    segment = better;
  }
  Trial trial{&other, ExactLines(other, segment, model), segment.Count(subset_.rows()), 0, 0, 0};
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

/// Distinct payloads as bits; payloads within 1 % of each other, as labels are rounded, share a
/// bit.
class PayloadLevels {
 public:
  explicit PayloadLevels(std::vector<double> values_kg) {
    std::sort(values_kg.begin(), values_kg.end());
    constexpr double kSamePayload = 1.01, kZero_kg = 1e-3;
    for (const double value_kg : values_kg) {
      if (lows_.empty() || value_kg > kSamePayload * lows_.back() + kZero_kg)
        lows_.push_back(value_kg);
    }
  }
  /// True if there are few distinct payloads rather than a continuum.
  bool AreFew() const { return lows_.size() <= 64; }
  std::uint64_t BitOf(double value_kg) const {
    const auto above = std::upper_bound(lows_.begin(), lows_.end(), value_kg);
    return std::uint64_t{1} << (above - lows_.begin() - 1);
  }

 private:
  std::vector<double> lows_;
};

/// The segment on one side whose conversion leaves the fewest distinct payloads (the shortest if
/// several do), because the converted rows repeat the payloads of the other side; nullopt if no
/// conversion reduces their number.
std::optional<Segment> SegmentOfRepeatedPayloads(const PerRow<double>& payloads_kg, double factor,
                                                 bool from) {
  std::vector<double> values_kg;
  for (const double payload_kg : payloads_kg) {
    values_kg.push_back(payload_kg);
    values_kg.push_back(payload_kg * factor);
  }
  const PayloadLevels levels(values_kg);
  const int rows = payloads_kg.count();
  if (!levels.AreFew() || rows < 2 * kMinRowsPerSide) return std::nullopt;
  using Bits = PerRow<std::uint64_t>;  // of the rows before a change, or from it on
  const auto places = static_cast<std::size_t>(rows) + 1;
  Bits before(places, 0), after(places, 0);
  const auto bit = [&](RowIndex row, bool converted) {
    return levels.BitOf(payloads_kg[row] * (converted ? factor : 1));
  };
  for (const RowIndex row : payloads_kg.indices()) {
    before[RowIndex(row.value() + 1)] = before[row] | bit(row, !from);
  }
  for (int k = rows; k-- > 0;) {
    after[RowIndex(k)] = after[RowIndex(k + 1)] | bit(RowIndex(k), from);
  }
  const RowIndex unchanged(from ? rows : 0);
  int fewest = std::popcount(before[unchanged] | after[unchanged]);
  std::optional<Segment> best;
  for (int k = kMinRowsPerSide; k + kMinRowsPerSide <= rows; ++k) {
    const RowIndex change(from ? rows - k : k);
    const int distinct = std::popcount(before[change] | after[change]);
    if (distinct >= fewest) continue;
    fewest = distinct;
    best = Segment{change, from};
  }
  return best;
}

Mistake SubtleChange(const OtherUnit& other, const Lines& lines) {
  Mistake mistake{fmt::format("{} holds {} {}", other.columns, other.unit, lines.Phrase()),
                  fmt::format("write {} in every row", other.declared),
                  [other, lines](Dataset& changed) { Convert(other, lines, changed); }};
  mistake.subtle = true;
  mistake.affects = [lines](const table::MeasuredRow& row) { return lines.Contains(row); };
  return mistake;
}

void AddPayloadChanges(const Dataset& data, std::vector<Mistake>& mistakes) {
  constexpr double kOtherScale = 1.12;  // the rows distinguish scales that differ by this factor
  PerRow<double> payloads_kg;
  for (const table::MeasuredRow& row : data.table.rows) payloads_kg.push_back(*row.payload_kg);
  for (const auto& [factor, unit] : kPayloadUnits) {
    for (const bool from : {true, false}) {
      const std::optional<Segment> segment = SegmentOfRepeatedPayloads(payloads_kg, factor, from);
      if (!segment) continue;
      const Lines lines = LinesOf(data, *segment);
      Mistake mistake = SubtleChange(PayloadIn(unit, factor), lines);
      for (const double scale : {factor / kOtherScale, factor * kOtherScale}) {
        mistake.alternatives.emplace_back(
            [other = PayloadIn(unit, scale), lines](Dataset& changed) {
              Convert(other, lines, changed);
            });
      }
      mistakes.push_back(std::move(mistake));
    }
  }
}

/// The segment on one side in which a joint remains within one turn if read as radians; nullopt
/// unless the other side exceeds this by far.
std::optional<Segment> SegmentWithinOneTurn(const Dataset& data, int joint, bool from) {
  constexpr double kTurn_rad = 2 * std::numbers::pi * kRadPerDeg;  // radians read as degrees
  const int rows = data.rows();
  int length = 0;
  double beyond = 0;
  for (int k = 0; k < rows; ++k) {
    const RowIndex row(from ? rows - 1 - k : k);
    const double size = std::abs(data.measured(row).q[joint]);
    if (beyond == 0 && size <= kTurn_rad) {
      ++length;
    } else {
      beyond = std::max(beyond, size);
    }
  }
  const Segment segment{RowIndex(from ? rows - length : length), from};
  if (!IsLong(segment, rows) || beyond < kMinContrast * kTurn_rad) return std::nullopt;
  return segment;
}

void AddJointChanges(const Dataset& data, std::vector<Mistake>& mistakes) {
  for (int joint = 0; joint < data.cell.robot.size(); ++joint) {
    if (!IsRevolute(data, joint)) continue;
    for (const bool from : {true, false}) {
      const std::optional<Segment> segment = SegmentWithinOneTurn(data, joint, from);
      if (segment) mistakes.push_back(SubtleChange(InRadians(joint), LinesOf(data, *segment)));
    }
  }
}

}  // namespace

std::vector<Mistake> UnitChanges(const Dataset& data) {
  std::vector<Mistake> mistakes;
  AddJointChanges(data, mistakes);
  if (UsesPayload(data)) AddPayloadChanges(data, mistakes);
  return mistakes;
}

std::optional<std::string> PayloadsInGrams(const table::MeasuredTable& table) {
  if (table.excessive_payloads.size() < kMinRowsPerSide) return std::nullopt;
  std::vector<std::pair<int, double>> of_lines = table.excessive_payloads;
  for (const table::MeasuredRow& row : table.rows) of_lines.emplace_back(row.line, *row.payload_kg);
  std::sort(of_lines.begin(), of_lines.end());
  PerRow<double> payloads_kg;
  for (const auto& [line, payload_kg] : of_lines) payloads_kg.push_back(payload_kg);
  constexpr double kGram_kg = 1e-3;
  for (const bool from : {true, false}) {
    const std::optional<Segment> segment = SegmentOfRepeatedPayloads(payloads_kg, kGram_kg, from);
    if (!segment) continue;
    double most_kg = 0, most_of_others_kg = 0;
    for (const RowIndex row : payloads_kg.indices()) {
      double& most = segment->Contains(row) ? most_kg : most_of_others_kg;
      most = std::max(most, payloads_kg[row]);
    }
    const int last = segment->change.value() - (from ? 0 : 1);
    const Lines lines{of_lines[RowIndex(last).offset()].first, from};
    return fmt::format(
        "payload_kg holds grams {}: as read, {} rows have payloads up to {:.6g} kg, more than any "
        "robot carries, and the others up to {:.6g} kg; converted from grams, they have up to "
        "{:.6g} kg and the same payloads as the others. Write kilograms in every row",
        lines.Phrase(), segment->Count(payloads_kg.count()), most_kg, most_of_others_kg,
        kGram_kg * most_kg);
  }
  return std::nullopt;
}

std::optional<std::string> ChangedUnit(const Dataset& data, int threads) {
  const UnitChangeSearch search(data, threads);
  if (!search.HasGrossRows()) return std::nullopt;
  const std::optional<Trial> found = search.Best();
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

}  // namespace plumbline::diagnosis
