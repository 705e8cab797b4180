// Columns of a file as they are where their numbers have another unit than the name says.
#pragma once

#include <array>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "app/diagnosis/dataset.h"

namespace plumbline {

/// A column, or several together, in another unit.
struct OtherUnit {
  std::string columns;   ///< "q2_deg", "x_mm, y_mm, z_mm"
  std::string unit;      ///< that the numbers have: "radians"
  std::string declared;  ///< that the name says: "degrees"
  std::vector<std::function<double(const MeasuredRow&)>> numbers;
  /// Makes one row what it would be had its numbers the declared unit.
  std::function<void(Dataset&, RowIndex)> convert;
};

/// A turning joint; 0-based.
OtherUnit InRadians(int joint);
OtherUnit PayloadIn(const std::string& unit, double factor);

/// Kilograms in one of each unit.
inline constexpr std::array<std::pair<double, const char*>, 2> kPayloadUnits = {
    {{0.45359237, "pounds"}, {1e-3, "grams"}}};

bool Turns(const Dataset& data, int joint);
/// True where the payload's weight is computed.
bool PayloadCounts(const Dataset& data);

/// Every column that moves the predicted or the measured tip, in every unit that somebody writes.
std::vector<OtherUnit> OtherUnits(const Dataset& data);

}  // namespace plumbline
