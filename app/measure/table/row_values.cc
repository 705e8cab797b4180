#include "app/measure/table/row_values.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>

#include "app/base/config/limits.h"
#include "app/measure/table/csv_fields.h"

namespace plumbline::measure {
namespace {

constexpr double kMaxNumber = 1e12;  // no measurement is larger

/// One camera, or two in the order of their names in the format: "rear+side" gives "side+rear".
/// nullopt if the field names no camera, an unknown one, or one of them twice.
std::optional<std::string> CamerasNamed(std::string_view field) {
  constexpr std::array<std::string_view, 4> kNames = {"side", "rear", "front", "top"};
  const auto place = [&](std::string_view name) {
    return std::ranges::find(kNames, name) - kNames.begin();
  };
  const auto count = static_cast<std::ptrdiff_t>(kNames.size());
  const auto plus = field.find('+');
  const std::ptrdiff_t first = place(field.substr(0, plus));
  if (first == count) return std::nullopt;
  if (plus == std::string_view::npos) return std::string(field);
  const std::ptrdiff_t second = place(field.substr(plus + 1));
  if (second == count || second == first) return std::nullopt;
  return std::string(kNames[std::min(first, second)]) + "+" +
         std::string(kNames[std::max(first, second)]);
}

bool IsMeasured(Quantity quantity) {
  switch (quantity) {
    case Quantity::kPosition:
    case Quantity::kRange:
    case Quantity::kOrientation:
    case Quantity::kArtefact:
    case Quantity::kGauge:
    case Quantity::kSigma:
    case Quantity::kCamera:
      return true;
    default:
      return false;
  }
}

/// Marks an empty cell of a measured table for FillEmptyCells(). Returns why the row cannot be used
/// without it, or an empty string.
std::string StoreEmpty(const Column& column, TableUse use, MeasuredRow& row) {
  const char* const needed = "is empty";
  switch (column.quantity) {
    case Quantity::kSession:
    case Quantity::kQ:
      return needed;
    case Quantity::kPosition:
      row.measured_W->setConstant(std::nan(""));
      return {};
    case Quantity::kOrientation:
      row.orientation_W->coeffs().setConstant(std::nan(""));
      return {};
    case Quantity::kRange:
    case Quantity::kGauge:
    case Quantity::kArtefact:
    case Quantity::kSigma:
    case Quantity::kCamera:
      return {};
    default:
      break;
  }
  if (use == TableUse::kPoses) return needed;
  switch (column.quantity) {
    case Quantity::kQd:
      row.qd[column.index] = std::nan("");
      break;
    case Quantity::kQdd:
      row.qdd[column.index] = std::nan("");
      break;
    case Quantity::kTau:
      row.tau[column.index] = std::nan("");
      break;
    default:
      break;
  }
  return {};
}

/// Stores the number of a tool or payload item. Anything else leaves it absent, which is a fault
/// only if the cell declares several tools or items (numbered_rows.h).
void StoreToolOrItem(const Column& column, std::string_view field, MeasuredRow& row) {
  constexpr int kLargest = 65535;
  double number = 0;  // spreadsheets write 1 as 1.0
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), number);
  if (error != std::errc() || end != field.data() + field.size()) return;
  if (!(number >= 0 && number <= kLargest) || number != std::floor(number)) return;
  (column.quantity == Quantity::kTool ? row.tool_number : row.payload_item) =
      static_cast<int>(number);
}

/// Stores a name. Returns why it is not one, or an empty string.
std::string StoreName(Quantity quantity, std::string_view field, MeasuredRow& row) {
  if (quantity == Quantity::kSession) row.session = std::string(field);
  if (quantity == Quantity::kArtefact) row.artefact = std::string(field);
  if (quantity != Quantity::kCamera) return {};
  const auto camera = CamerasNamed(field);
  if (!camera) return std::string(kNotACamera);
  row.camera = *camera;
  return {};
}

/// Stores a number that was converted to SI. Returns why it cannot be a value of the quantity, or
/// an empty string.
std::string StoreValue(const Column& column, std::string_view field, double value,
                       MeasuredRow& row) {
  switch (column.quantity) {
    case Quantity::kTime:
      row.t_s = value;
      break;
    case Quantity::kQ:
      row.q[column.index] = value;
      break;
    case Quantity::kQd:
      row.qd[column.index] = value;
      break;
    case Quantity::kQdd:
      row.qdd[column.index] = value;
      break;
    case Quantity::kTau:
      row.tau[column.index] = value;
      break;
    case Quantity::kPayload:
      if (value < 0 || value > loads::kMaxPayload_kg) {
        return fmt::format("{:g} is outside 0..{:g}", value, loads::kMaxPayload_kg);
      }
      row.payload_kg = value;
      break;
    case Quantity::kTemperature:
      row.temp_C = value;
      break;
    case Quantity::kPosition:
      (*row.measured_W)[column.index] += value;  // remains NaN if another cell is empty
      break;
    case Quantity::kRange:
      if (value < 0) return Shown(field) + " is negative";
      row.range_m = value;
      break;
    case Quantity::kOrientation:
      // Eigen stores (x, y, z, w); the columns are (w, x, y, z).
      row.orientation_W->coeffs()[(column.index + 3) % 4] += value;
      break;
    case Quantity::kJointStep:
      if (value < 0) return Shown(field) + " is negative";
      row.q_step_rad = value;
      break;
    case Quantity::kGauge:
      row.gauge_m = value;
      break;
    case Quantity::kSigma:
      if (!(value > 0)) return Shown(field) + " is not positive";
      if (constexpr config::NumberRange kRange = config::kSigmaRange;
          value < kRange.min * kRange.to_si || value > kRange.max * kRange.to_si) {
        return fmt::format("{} is outside {:g}..{:g}", Shown(field), kRange.min, kRange.max);
      }
      row.sigma_m = value;
      break;
    case Quantity::kArtefact:
    case Quantity::kCamera:
    case Quantity::kFurther:
    case Quantity::kSession:
    case Quantity::kTool:
    case Quantity::kPayloadItem:
    case Quantity::kUnused:
      break;
  }
  return {};
}

}  // namespace

double NumberOrInfinity(std::string_view field) {
  double number = 0;
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), number);
  const bool whole = error == std::errc() && end == field.data() + field.size();
  return whole && std::abs(number) <= kMaxNumber ? number : HUGE_VAL;
}

std::string StoreField(const Column& column, std::string_view field, TableUse use,
                       MeasuredRow& row) {
  const Quantity quantity = column.quantity;
  if (quantity == Quantity::kUnused) return {};
  if (use == TableUse::kPoses && IsMeasured(quantity)) return {};
  if (quantity == Quantity::kFurther) {
    row.further[column.index] = field.empty() ? std::nan("") : NumberOrInfinity(field);
    return {};
  }
  if (quantity == Quantity::kTool || quantity == Quantity::kPayloadItem) {
    StoreToolOrItem(column, field, row);
    return {};
  }
  if (field.empty()) return StoreEmpty(column, use, row);
  if (quantity == Quantity::kSession || quantity == Quantity::kArtefact ||
      quantity == Quantity::kCamera) {
    return StoreName(quantity, field, row);
  }
  double number = 0;
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), number);
  if (error == std::errc::result_out_of_range) return Shown(field) + " is out of range";
  if (error != std::errc() || end != field.data() + field.size()) {
    return Shown(field) + " is not a number";
  }
  if (!std::isfinite(number)) return Shown(field) + " is not a finite number";
  if (std::abs(number) > kMaxNumber) return Shown(field) + " is out of range";
  return StoreValue(column, field, number * column.to_si, row);
}

}  // namespace plumbline::measure
