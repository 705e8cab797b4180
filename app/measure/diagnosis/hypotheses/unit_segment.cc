#include "app/measure/diagnosis/hypotheses/unit_segment.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "firmware-like/geometry/units.h"
#include "firmware-like/model/joint_columns.h"

namespace plumbline::measure {
namespace {

/// Distinct payloads as bits; payloads within 1 % of each other, as labels are rounded, share a
/// bit.
class PayloadLevels {
 public:
  explicit PayloadLevels(std::vector<double> values_kg) {
    std::ranges::sort(values_kg);
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
std::optional<RowSegment> SegmentOfRepeatedPayloads(const PerRow<double>& payloads_kg,
                                                    double factor, bool from) {
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
  std::optional<RowSegment> best;
  for (int k = kMinRowsPerSide; k + kMinRowsPerSide <= rows; ++k) {
    const RowIndex change(from ? rows - k : k);
    const int distinct = std::popcount(before[change] | after[change]);
    if (distinct >= fewest) continue;
    fewest = distinct;
    best = RowSegment{change, from};
  }
  return best;
}

}  // namespace

std::vector<Mistake> PayloadUnitChanges(const Dataset& data) {
  constexpr double kOtherScale = 1.12;  // the rows distinguish scales that differ by this factor
  std::vector<Mistake> mistakes;
  PerRow<double> payloads_kg;
  for (const MeasuredRow& row : data.table.rows) payloads_kg.push_back(*row.payload_kg);
  for (const auto& [factor, unit] : kPayloadUnits) {
    for (const bool from : {true, false}) {
      const std::optional<RowSegment> segment =
          SegmentOfRepeatedPayloads(payloads_kg, factor, from);
      if (!segment) continue;
      const LineSegment lines = LinesOf(data, *segment);
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
  return mistakes;
}

std::optional<std::string> PayloadsInGrams(const MeasuredTable& table) {
  if (table.excessive_payloads.size() < kMinRowsPerSide) return std::nullopt;
  std::vector<std::pair<int, double>> of_lines = table.excessive_payloads;
  for (const MeasuredRow& row : table.rows) of_lines.emplace_back(row.line, *row.payload_kg);
  std::ranges::sort(of_lines);
  PerRow<double> payloads_kg;
  for (const auto& [line, payload_kg] : of_lines) payloads_kg.push_back(payload_kg);
  constexpr double kGram_kg = 1e-3;
  for (const bool from : {true, false}) {
    const std::optional<RowSegment> segment =
        SegmentOfRepeatedPayloads(payloads_kg, kGram_kg, from);
    if (!segment) continue;
    double most_kg = 0, most_of_others_kg = 0;
    for (const RowIndex row : payloads_kg.indices()) {
      double& most = segment->Contains(row) ? most_kg : most_of_others_kg;
      most = std::max(most, payloads_kg[row]);
    }
    const int last = segment->change.value() - (from ? 0 : 1);
    const LineSegment lines{of_lines[RowIndex(last).offset()].first, from};
    return fmt::format(
        "payload_kg holds grams {}: as read, {} rows have payloads up to {:.6g} kg, more than any "
        "robot carries, and the others up to {:.6g} kg; converted from grams, they have up to "
        "{:.6g} kg and the same payloads as the others. Write kilograms in every row",
        lines.Phrase(), segment->Count(payloads_kg.count()), most_kg, most_of_others_kg,
        kGram_kg * most_kg);
  }
  return std::nullopt;
}

namespace {

constexpr std::array<std::pair<double, const char*>, 3> kLengthUnits = {
    {{1000, "metres"}, {25.4, "inches"}, {10, "centimetres"}}};

void ScaleJoint(Dataset& data, RowIndex row, int joint, double factor) {
  data.table.rows[row.offset()].q[joint] *= factor;
  data.conditions[row].q[joint] *= factor;
}

OtherUnit JointIn(int joint, model::JointType type, const std::string& unit, double factor) {
  OtherUnit other{model::JointColumnName(model::JointQuantity::kPosition, type, joint),
                  unit,
                  type == model::JointType::kRevolute ? "degrees" : "millimetres",
                  {},
                  {}};
  other.numbers = {[joint](const MeasuredRow& row) { return row.q[joint]; }};
  other.convert = [joint, factor](Dataset& data, RowIndex row) {
    ScaleJoint(data, row, joint, factor);
  };
  return other;
}

/// All revolute joints together.
OtherUnit AllInRadians(const Dataset& data) {
  OtherUnit other{"the q columns", "radians", "degrees", {}, {}};
  std::vector<int> revolute;
  for (int joint = 0; joint < data.cell.robot.size(); ++joint) {
    if (!IsRevolute(data, joint)) continue;
    revolute.push_back(joint);
    other.numbers.emplace_back([joint](const MeasuredRow& row) { return row.q[joint]; });
  }
  other.convert = [revolute](Dataset& changed, RowIndex row) {
    for (const int joint : revolute) ScaleJoint(changed, row, joint, 1 / kRadPerDeg);
  };
  return other;
}

/// Adds the columns of measured positions (together and one by one) or ranges.
void AddMeasured(const Dataset& data, double factor, const char* unit,
                 std::vector<OtherUnit>& others) {
  if (data.ranges()) {
    others.push_back({"range_mm",
                      unit,
                      "millimetres",
                      {[](const MeasuredRow& row) { return row.range_m.value_or(0); }},
                      [factor](Dataset& changed, RowIndex row) {
                        std::optional<double>& range_m = changed.table.rows[row.offset()].range_m;
                        if (range_m) *range_m *= factor;
                      }});
    return;
  }
  const auto axes = [&](const std::string& columns, int first, int last) {
    OtherUnit other{columns, unit, "millimetres", {}, {}};
    for (int axis = first; axis <= last; ++axis) {
      other.numbers.emplace_back(
          [axis](const MeasuredRow& row) { return row.measured_W.value_or(Vec3::Zero())[axis]; });
    }
    other.convert = [factor, first, last](Dataset& changed, RowIndex row) {
      std::optional<Vec3>& measured_W = changed.table.rows[row.offset()].measured_W;
      if (measured_W) measured_W->segment(first, last - first + 1) *= factor;
    };
    others.push_back(std::move(other));
  };
  axes("x_mm, y_mm, z_mm", 0, 2);
  for (int axis = 0; axis < 3; ++axis) axes(std::string(1, "xyz"[axis]) + "_mm", axis, axis);
}

}  // namespace

bool IsRevolute(const Dataset& data, int joint) {
  return data.cell.robot.joints[joint].type != model::JointType::kPrismatic;
}

bool UsesPayload(const Dataset& data) {
  // With items, the mass of a row is only in part that of its cell in the table.
  return data.table.recorded.payload && data.cell.payload_cog_F && data.cell.payload_items.empty();
}

OtherUnit InRadians(int joint) {
  return JointIn(joint, model::JointType::kRevolute, "radians", 1 / kRadPerDeg);
}

OtherUnit PayloadIn(const std::string& unit, double factor) {
  OtherUnit other{"payload_kg", unit, "kilograms", {}, {}};
  other.numbers = {[](const MeasuredRow& row) { return *row.payload_kg; }};
  other.convert = [factor](Dataset& data, RowIndex row) {
    *data.table.rows[row.offset()].payload_kg *= factor;
    data.conditions[row].payload_kg *= factor;
    data.payloads[row].mass_kg *= factor;
  };
  return other;
}

std::vector<OtherUnit> OtherUnits(const Dataset& data) {
  std::vector<OtherUnit> others = {AllInRadians(data)};
  for (int joint = 0; joint < data.cell.robot.size(); ++joint) {
    if (IsRevolute(data, joint)) {
      others.push_back(InRadians(joint));
      continue;
    }
    for (const auto& [factor, unit] : kLengthUnits) {
      others.push_back(JointIn(joint, model::JointType::kPrismatic, unit, factor));
    }
  }
  for (const auto& [factor, unit] : kLengthUnits) AddMeasured(data, factor, unit, others);
  if (!UsesPayload(data)) return others;
  for (const auto& [factor, unit] : kPayloadUnits) others.push_back(PayloadIn(unit, factor));
  return others;
}

namespace {

constexpr double kMinContrast = 5;  // minimum ratio of the largest angle to one turn in radians

/// The segment on one side in which a joint remains within one turn if read as radians; nullopt
/// unless the other side exceeds this by far.
std::optional<RowSegment> SegmentWithinOneTurn(const Dataset& data, int joint, bool from) {
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
  const RowSegment segment{RowIndex(from ? rows - length : length), from};
  if (!segment.IsLong(rows) || beyond < kMinContrast * kTurn_rad) return std::nullopt;
  return segment;
}

void AddJointChanges(const Dataset& data, std::vector<Mistake>& mistakes) {
  for (int joint = 0; joint < data.cell.robot.size(); ++joint) {
    if (!IsRevolute(data, joint)) continue;
    for (const bool from : {true, false}) {
      const std::optional<RowSegment> segment = SegmentWithinOneTurn(data, joint, from);
      if (segment) mistakes.push_back(SubtleChange(InRadians(joint), LinesOf(data, *segment)));
    }
  }
}

}  // namespace

std::vector<Mistake> UnitChanges(const Dataset& data) {
  std::vector<Mistake> mistakes;
  AddJointChanges(data, mistakes);
  if (!UsesPayload(data)) return mistakes;
  for (Mistake& change : PayloadUnitChanges(data)) mistakes.push_back(std::move(change));
  return mistakes;
}

bool RowSegment::IsLong(int rows) const {
  return change.value() >= kMinRowsPerSide && rows - change.value() >= kMinRowsPerSide;
}

std::string LineSegment::Text() const {
  return fmt::format("{} line {}", from ? "from" : "up to", line);
}

std::string LineSegment::Phrase() const {
  return from ? Text() + " on" : Text();
}

LineSegment LinesOf(const Dataset& data, const RowSegment& segment) {
  const RowIndex row = segment.from ? segment.change : RowIndex(segment.change.value() - 1);
  return {data.measured(row).line, segment.from};
}

void Convert(const OtherUnit& other, const LineSegment& lines, Dataset& data) {
  for (const RowIndex row : data.row_indices()) {
    if (lines.Contains(data.measured(row))) other.convert(data, row);
  }
}

Mistake SubtleChange(const OtherUnit& other, const LineSegment& lines) {
  Mistake mistake{fmt::format("{} holds {} {}", other.columns, other.unit, lines.Phrase()),
                  fmt::format("write {} in every row", other.declared),
                  [other, lines](Dataset& changed) { Convert(other, lines, changed); }};
  mistake.subtle = true;
  mistake.affects = [lines](const MeasuredRow& row) { return lines.Contains(row); };
  return mistake;
}

namespace {

// Read as Fahrenheit, 55 to 120 is 13 to 49 deg C, the range of a working cell.
constexpr model::Interval kLikely{55, 120};
constexpr std::size_t kMinTemperatures = 4;  // fewer are single wrong rows instead of another unit

double CelsiusFrom(double fahrenheit) {
  return (fahrenheit - 32) / 1.8;
}

/// The temperatures from kLikely.low on, ascending; empty if they are few, if some of them are hot
/// in degrees Fahrenheit too, or if the others lead up to them as in a warm-up.
std::vector<double> LikelyFahrenheit(const MeasuredTable& table) {
  constexpr double kMinGap = 10;
  std::vector<double> temperatures;
  if (!table.recorded.temperature) return temperatures;
  double coldest = kLikely.high, hottest_of_others = -HUGE_VAL;
  for (const MeasuredRow& row : table.rows) {
    const double temp_C = *row.temp_C;
    if (temp_C >= kLikely.low) {
      temperatures.push_back(temp_C);
      coldest = std::min(coldest, temp_C);
    } else {
      hottest_of_others = std::max(hottest_of_others, temp_C);
    }
  }
  if (coldest - hottest_of_others < kMinGap) return {};
  std::ranges::sort(temperatures);
  if (temperatures.size() < kMinTemperatures || temperatures.back() > kLikely.high) return {};
  return temperatures;
}

std::string RowsText(const MeasuredTable& table, std::size_t likely) {
  if (likely == table.rows.size()) return "";
  const auto first = std::ranges::find_if(
      table.rows, [](const MeasuredRow& row) { return row.temp_C >= kLikely.low; });
  return fmt::format(" in {} of {} rows (first: line {})", likely, table.rows.size(), first->line);
}

}  // namespace

void NoteLikelyFahrenheit(MeasuredTable& table) {
  const std::vector<double> likely = LikelyFahrenheit(table);
  if (likely.empty()) return;
  table.notes.push_back(fmt::format(
      "temp_C is {:.3g} to {:.3g}{}, which is hot for a cell; if these are degrees Fahrenheit "
      "({:.3g} to {:.3g} deg C), convert them",
      likely.front(), likely.back(), RowsText(table, likely.size()), CelsiusFrom(likely.front()),
      CelsiusFrom(likely.back())));
}

std::optional<Mistake> FahrenheitMistake(const Dataset& data) {
  const std::size_t likely = LikelyFahrenheit(data.table).size();
  if (likely == 0) return std::nullopt;
  const bool all = likely == data.table.rows.size();
  Mistake mistake{"temp_C holds degrees Fahrenheit" + RowsText(data.table, likely),
                  all ? "write degrees Celsius; if it is in degrees Celsius, correct "
                        "reference_temperature_C, which has the same effect"
                      : "write degrees Celsius in every row",
                  [](Dataset& changed) {
                    for (const RowIndex row : changed.row_indices()) {
                      double& temp_C = *changed.table.rows[row.offset()].temp_C;
                      if (temp_C < kLikely.low) continue;
                      temp_C = CelsiusFrom(temp_C);
                      changed.conditions[row].temp_C = temp_C;
                    }
                  }};
  mistake.subtle = true;
  mistake.affects = [](const MeasuredRow& row) { return row.temp_C >= kLikely.low; };
  return mistake;
}

}  // namespace plumbline::measure
