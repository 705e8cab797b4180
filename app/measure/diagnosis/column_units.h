// Units that the numbers of a column may really be in, other than the unit of its name.
#pragma once

#include <array>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "app/measure/diagnosis/dataset.h"

namespace plumbline::measure {

/// A column, or several that are wrong together, and the unit its numbers may really be in.
struct OtherUnit {
  std::string columns;   ///< "q2_deg", "x_mm, y_mm, z_mm"
  std::string unit;      ///< of the numbers: "radians"
  std::string declared;  ///< stated by the column name: "degrees"
  std::vector<std::function<double(const MeasuredRow&)>> numbers;
  /// Converts the numbers of one row to the declared unit.
  std::function<void(Dataset&, RowIndex)> convert;
};

/// Angles of a revolute joint (0-based) in radians.
OtherUnit InRadians(int joint);
OtherUnit PayloadIn(const std::string& unit, double factor);

/// Payload units other than kilograms, with their size in kilograms.
inline constexpr std::array<std::pair<double, const char*>, 2> kPayloadUnits = {
    {{0.45359237, "pounds"}, {1e-3, "grams"}}};

/// True if the joint (0-based) is revolute; its column is then in degrees.
bool IsRevolute(const Dataset& data, int joint);
/// True if the model uses the payload's weight: it is recorded, and the cell has a [payload].
bool UsesPayload(const Dataset& data);

/// Every column that affects the predicted or measured tip, in each unit commonly mistaken for it.
std::vector<OtherUnit> OtherUnits(const Dataset& data);

}  // namespace plumbline::measure
