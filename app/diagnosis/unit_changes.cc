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

constexpr int kRows = 120;            // that find the line; the rows around it find it exactly
constexpr int kFewestOfASide = 4;     // a shorter stretch is a few wrong rows, not another unit
constexpr double kLeastContrast = 5;  // of a joint's range over a turn in radians

/// The rows from a place on, or those before it.
struct Stretch {
  RowIndex place;
  bool from = true;

  bool Contains(RowIndex row) const { return from == (row >= place); }
  int Count(int rows) const { return from ? rows - place.value() : place.value(); }
};

/// The same by the line of the file, which thinned rows keep.
struct Lines {
  int line = 0;  ///< the first or the last one
  bool from = true;

  bool Contains(const table::MeasuredRow& row) const {
    return from ? row.line >= line : row.line <= line;
  }
  std::string Text() const { return fmt::format("{} line {}", from ? "from" : "up to", line); }
  std::string Onwards() const { return from ? Text() + " on" : Text(); }
};

Lines LinesOf(const Dataset& data, const Stretch& stretch) {
  const RowIndex row = stretch.from ? stretch.place : RowIndex(stretch.place.value() - 1);
  return {data.measured(row).line, stretch.from};
}

/// True where both sides are long enough.
bool IsLong(const Stretch& stretch, int rows) {
  const int place = stretch.place.value();
  return place >= kFewestOfASide && rows - place >= kFewestOfASide;
}

void Convert(const OtherUnit& other, const Lines& lines, Dataset& data) {
  for (const RowIndex row : data.row_indices()) {
    if (lines.Contains(data.measured(row))) other.convert(data, row);
  }
}

/// Where a column's numbers change their spread or their mean most: the place between two rows of
/// greatest likelihood under normal numbers of two kinds, n_1 ln s_1^2 + n_2 ln s_2^2 least.
std::optional<RowIndex> WhereNumbersChange(const Dataset& data, const OtherUnit& other) {
  const int rows = data.rows();
  if (rows < 2 * kFewestOfASide) return std::nullopt;
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
      constexpr double kRounding = 1e-10;  // of a spread, next to the largest number squared
      const auto n = static_cast<double>(last - first);
      const double mean = (sum[last] - sum[first]) / n;
      const double variance = (squares[last] - squares[first]) / n - mean * mean;
      return n * std::log(std::max(variance, 0.0) + kRounding);
    };
    const auto end = static_cast<std::size_t>(rows);
    for (std::size_t k = kFewestOfASide; k + kFewestOfASide <= end; ++k) {
      costs[k] += part(0, k) + part(k, end);
    }
  }
  const auto first = costs.begin() + kFewestOfASide, last = costs.end() - kFewestOfASide;
  return RowIndex(std::min_element(first, last) - costs.begin());
}

/// How far each measured point lies from the predicted one [m]; infinite where the sagged posture
/// does not settle.
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

/// The stretch of least loss under a model, of those on the same side; of equal ones the shortest,
/// so that every row at its end needs it.
Stretch LeastLoss(const Dataset& data, const OtherUnit& other, const Model& model, bool from) {
  Dataset converted = data;
  for (const RowIndex row : data.row_indices()) other.convert(converted, row);
  const PerRow<double> as_read = DistancesAt(data, model);
  const PerRow<double> read_anew = DistancesAt(converted, model);
  double gain = 0, most = 0;  // of converting the rows before a place
  Stretch best{RowIndex(from ? data.rows() : 0), from};
  const auto take = [&](RowIndex place) {
    if (!(gain > most + 1e-9 * kGross_m)) return;
    most = gain;
    best.place = place;
  };
  if (from) {
    for (int k = data.rows(); k-- > 0;) {
      const RowIndex row(k);
      gain += LossOf(as_read[row]) - LossOf(read_anew[row]);
      take(row);
    }
  } else {
    for (const RowIndex row : data.row_indices()) {
      gain += LossOf(as_read[row]) - LossOf(read_anew[row]);
      take(RowIndex(row.value() + 1));
    }
  }
  return best;
}

/// A change of unit, and what the rows look like with it taken back.
struct Tried {
  const OtherUnit* other = nullptr;
  Lines lines;
  int changed = 0;                   ///< rows of the data asked
  double before_m = 0, after_m = 0;  ///< middle distance of those rows
  double loss_m = HUGE_VAL;          ///< mean over all rows
};

class UnitChangeSearch {
 public:
  UnitChangeSearch(const Dataset& data, int threads)
      : data_(data), few_(SelectRows(data, EvenlySpacedRows(data, kRows))), threads_(threads) {
    const Result<Model> model = Align(few_, Model::Declared(few_), threads_);
    if (model) {
      as_read_ = DistancesAt(few_, *model);
    } else {
      as_read_.assign(static_cast<std::size_t>(few_.rows()), HUGE_VAL);
    }
  }

  bool Suspects() const {
    return std::count_if(as_read_.begin(), as_read_.end(), [](double distance_m) {
             return distance_m >= kGross_m;
           }) >= kFewestOfASide;
  }

  std::optional<Tried> Best() const {
    std::optional<Tried> best;
    for (const OtherUnit& other : others_) {
      for (const bool from : {true, false}) {
        const std::optional<Tried> tried = Try(other, from);
        if (tried && (!best || tried->loss_m < best->loss_m)) best = tried;
      }
    }
    return best;
  }

 private:
  std::optional<Tried> Try(const OtherUnit& other, bool from) const;
  Lines ExactLines(const OtherUnit& other, const Stretch& stretch, const Model& model) const;

  const Dataset& data_;
  Dataset few_;
  int threads_;
  PerRow<double> as_read_;
  std::vector<OtherUnit> others_ = OtherUnits(data_);
};

/// The line among all rows around a place among the few.
Lines UnitChangeSearch::ExactLines(const OtherUnit& other, const Stretch& stretch,
                                   const Model& model) const {
  const int before = std::max(0, stretch.place.value() - 2);
  const int after = std::min(few_.rows() - 1, stretch.place.value() + 1);
  const int first_line = few_.measured(RowIndex(before)).line;
  const int last_line = few_.measured(RowIndex(after)).line;
  FitRows around;
  for (const RowIndex row : data_.row_indices()) {
    const int line = data_.measured(row).line;
    if (line >= first_line && line <= last_line) around.push_back(row);
  }
  const Dataset rows = SelectRows(data_, around);
  const Stretch exact = LeastLoss(rows, other, model, stretch.from);
  const int changed = exact.Count(rows.rows());
  return changed > 0 ? LinesOf(rows, exact) : LinesOf(few_, stretch);
}

std::optional<Tried> UnitChangeSearch::Try(const OtherUnit& other, bool from) const {
  const std::optional<RowIndex> start = WhereNumbersChange(few_, other);
  if (!start) return std::nullopt;
  Stretch stretch{*start, from};
  Model model = Model::Declared(few_);
  PerRow<double> left;
  constexpr int kRounds = 3;  // of frames for a place, and the place for those frames
  for (int round = 0; round < kRounds; ++round) {
    Dataset changed = few_;
    Convert(other, LinesOf(few_, stretch), changed);
    const Result<Model> aligned = Align(changed, Model::Declared(changed), threads_);
    if (!aligned) return std::nullopt;
    model = *aligned;
    left = DistancesAt(changed, model);
    const Stretch better = LeastLoss(few_, other, model, from);
    if (!IsLong(better, few_.rows())) return std::nullopt;
    if (better.place == stretch.place) break;
    stretch = better;
  }
  Tried tried{&other, ExactLines(other, stretch, model), stretch.Count(few_.rows()), 0, 0, 0};
  std::vector<double> before, after;
  int gross = 0;
  for (const RowIndex row : few_.row_indices()) {
    gross += left[row] >= kGross_m ? 1 : 0;
    tried.loss_m += LossOf(left[row]) / few_.rows();
    if (!stretch.Contains(row)) continue;
    before.push_back(as_read_[row]);
    after.push_back(left[row]);
  }
  tried.before_m = statistics::MedianOf(before);
  tried.after_m = statistics::MedianOf(after);
  const bool explains = tried.before_m >= kGross_m && tried.after_m < kNamed * tried.before_m &&
                        gross <= kMaxOutliers * few_.rows();
  return explains ? std::optional(tried) : std::nullopt;
}

/// Payloads as bits: those within a hundredth of each other, as labels are rounded, have one.
class PayloadLevels {
 public:
  explicit PayloadLevels(std::vector<double> values_kg) {
    std::sort(values_kg.begin(), values_kg.end());
    constexpr double kAlike = 1.01, kNothing_kg = 1e-3;
    for (const double value_kg : values_kg) {
      if (lows_.empty() || value_kg > kAlike * lows_.back() + kNothing_kg)
        lows_.push_back(value_kg);
    }
  }
  /// Payloads of a few sizes, not a weighed stream.
  bool Few() const { return lows_.size() <= 64; }
  std::uint64_t BitOf(double value_kg) const {
    const auto above = std::upper_bound(lows_.begin(), lows_.end(), value_kg);
    return std::uint64_t{1} << (above - lows_.begin() - 1);
  }

 private:
  std::vector<double> lows_;
};

/// The rows on one side that, converted, repeat the payloads of the others: the shortest of those
/// that leave the fewest payloads, where these are fewer than as read.
std::optional<Stretch> WherePayloadsRepeat(const PerRow<double>& payloads_kg, double factor,
                                           bool from) {
  std::vector<double> values_kg;
  for (const double payload_kg : payloads_kg) {
    values_kg.push_back(payload_kg);
    values_kg.push_back(payload_kg * factor);
  }
  const PayloadLevels levels(values_kg);
  const int rows = payloads_kg.count();
  if (!levels.Few() || rows < 2 * kFewestOfASide) return std::nullopt;
  using Bits = PerRow<std::uint64_t>;  // of the rows before a place, of those from it on
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
  std::optional<Stretch> best;
  for (int k = kFewestOfASide; k + kFewestOfASide <= rows; ++k) {
    const RowIndex place(from ? rows - k : k);
    const int distinct = std::popcount(before[place] | after[place]);
    if (distinct >= fewest) continue;
    fewest = distinct;
    best = Stretch{place, from};
  }
  return best;
}

Mistake SubtleChange(const OtherUnit& other, const Lines& lines) {
  Mistake mistake{fmt::format("{} holds {} {}", other.columns, other.unit, lines.Onwards()),
                  fmt::format("write {} in every row", other.declared),
                  [other, lines](Dataset& changed) { Convert(other, lines, changed); }};
  mistake.subtle = true;
  mistake.concerns = [lines](const table::MeasuredRow& row) { return lines.Contains(row); };
  return mistake;
}

void AddPayloadChanges(const Dataset& data, std::vector<Mistake>& mistakes) {
  constexpr double kBeside = 1.12;  // a size that the rows tell from the true one
  PerRow<double> payloads_kg;
  for (const table::MeasuredRow& row : data.table.rows) payloads_kg.push_back(row.payload_kg);
  for (const auto& [factor, unit] : kPayloadUnits) {
    for (const bool from : {true, false}) {
      const std::optional<Stretch> stretch = WherePayloadsRepeat(payloads_kg, factor, from);
      if (!stretch) continue;
      const Lines lines = LinesOf(data, *stretch);
      Mistake mistake = SubtleChange(PayloadIn(unit, factor), lines);
      for (const double beside : {factor / kBeside, factor * kBeside}) {
        mistake.beside.emplace_back([other = PayloadIn(unit, beside), lines](Dataset& changed) {
          Convert(other, lines, changed);
        });
      }
      mistakes.push_back(std::move(mistake));
    }
  }
}

/// The rows on one side where a joint stays within a turn, counted in radians; nothing where the
/// other side hardly leaves it.
std::optional<Stretch> WhereJointIsSmall(const Dataset& data, int joint, bool from) {
  constexpr double kTurn_rad = 2 * std::numbers::pi * kRadPerDeg;  // as degrees were read
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
  const Stretch stretch{RowIndex(from ? rows - length : length), from};
  if (!IsLong(stretch, rows) || beyond < kLeastContrast * kTurn_rad) return std::nullopt;
  return stretch;
}

void AddJointChanges(const Dataset& data, std::vector<Mistake>& mistakes) {
  for (int joint = 0; joint < data.cell.robot.size(); ++joint) {
    if (!Turns(data, joint)) continue;
    for (const bool from : {true, false}) {
      const std::optional<Stretch> stretch = WhereJointIsSmall(data, joint, from);
      if (stretch) mistakes.push_back(SubtleChange(InRadians(joint), LinesOf(data, *stretch)));
    }
  }
}

}  // namespace

std::vector<Mistake> UnitChanges(const Dataset& data) {
  std::vector<Mistake> mistakes;
  AddJointChanges(data, mistakes);
  if (PayloadCounts(data)) AddPayloadChanges(data, mistakes);
  return mistakes;
}

std::optional<std::string> PayloadsInGrams(const table::MeasuredTable& table) {
  if (table.excessive_payloads.size() < kFewestOfASide) return std::nullopt;
  std::vector<std::pair<int, double>> of_lines = table.excessive_payloads;
  for (const table::MeasuredRow& row : table.rows) of_lines.emplace_back(row.line, row.payload_kg);
  std::sort(of_lines.begin(), of_lines.end());
  PerRow<double> payloads_kg;
  for (const auto& [line, payload_kg] : of_lines) payloads_kg.push_back(payload_kg);
  constexpr double kGram_kg = 1e-3;
  for (const bool from : {true, false}) {
    const std::optional<Stretch> stretch = WherePayloadsRepeat(payloads_kg, kGram_kg, from);
    if (!stretch) continue;
    double most_kg = 0, most_of_others_kg = 0;
    for (const RowIndex row : payloads_kg.indices()) {
      double& most = stretch->Contains(row) ? most_kg : most_of_others_kg;
      most = std::max(most, payloads_kg[row]);
    }
    const int last = stretch->place.value() - (from ? 0 : 1);
    const Lines lines{of_lines[RowIndex(last).offset()].first, from};
    return fmt::format(
        "payload_kg holds grams {}: as read, {} rows carry up to {:.6g} kg, which no robot does, "
        "and the others up to {:.6g}; as grams they carry {:.6g} kg, and both sides the same "
        "payloads. Write kilograms in every row",
        lines.Onwards(), stretch->Count(payloads_kg.count()), most_kg, most_of_others_kg,
        kGram_kg * most_kg);
  }
  return std::nullopt;
}

std::optional<std::string> ChangedUnit(const Dataset& data, int threads) {
  const UnitChangeSearch search(data, threads);
  if (!search.Suspects()) return std::nullopt;
  const std::optional<Tried> found = search.Best();
  if (!found) return std::nullopt;
  const std::string as_read =
      std::isfinite(found->before_m)
          ? fmt::format(
                "as read, measured points lie {:.0f} mm from where the declared cell puts "
                "them there (median)",
                1e3 * found->before_m)
          : std::string("as read, the arm's posture there cannot be computed");
  return fmt::format(
      "{} hold{} {} {}: {}; with those numbers converted to {} it is {:.2f} mm. "
      "Write {} in every row",
      found->other->columns, found->other->numbers.size() > 1 ? "" : "s", found->other->unit,
      found->lines.Onwards(), as_read, found->other->declared, 1e3 * found->after_m,
      found->other->declared);
}

}  // namespace plumbline::diagnosis
