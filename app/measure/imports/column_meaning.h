// Meaning and unit of a column, from its name.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace plumbline::measure {

/// Kinds of values, each with its units.
enum class ValueKind { kLength, kAngle, kTemperature, kMass, kTime, kNumber, kText };

/// A conversion to the unit of measured.csv: value * factor + offset.
struct UnitScale {
  double factor = 1;
  double offset = 0;
};

/// Conversion of a unit ("mm", "um", "µm", "in", "rad", "K" ..), or nullopt if the kind has no such
/// unit. An empty unit is that of measured.csv for kinds with one usual unit (time, mass, numbers),
/// and unknown for lengths, angles and temperatures.
std::optional<UnitScale> ScaleOf(ValueKind kind, std::string_view unit);
/// The units that ScaleOf() knows, for messages.
std::string UnitsOf(ValueKind kind);

/// Kind of a column of measured.csv, or of an auxiliary one: `number` (key that matches rows of two
/// files), `delete` (rows marked as deleted), `u95_mm`, `u95_x_mm`.. (expanded uncertainties),
/// `name` (of the point). nullopt if there is no such column.
std::optional<ValueKind> KindOfTarget(std::string_view target);

/// How a column is understood.
struct ColumnMeaning {
  std::string target;   ///< column of measured.csv or auxiliary one; empty: ignored
  std::string unit;     ///< as stated; empty: not stated
  std::string because;  ///< where meaning and unit come from, for the preview
  std::optional<std::size_t> same_as{};  ///< an earlier column of this meaning, used instead
};

/// Meanings of all columns of a file from their names and, if the file has one, the line of units.
/// Nominal values, deviations, statistics and ambient pressure and humidity are ignored; of two
/// columns with the same meaning the first one is used. A file with q0..q3 and no other column of
/// that form holds quaternions, scalar first; otherwise a joint 0 means that the joints are
/// numbered from 0.
std::vector<ColumnMeaning> MeaningsOf(const std::vector<std::string>& names,
                                      const std::vector<std::string>& units);

}  // namespace plumbline::measure
