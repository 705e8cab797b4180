#include "app/measure/diagnosis/payload_unit_changes.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstdint>

#include "app/measure/diagnosis/unit_segment.h"

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

}  // namespace plumbline::measure
