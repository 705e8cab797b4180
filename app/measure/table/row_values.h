// Values of a row: a field of the file parsed as the quantity of its column.
#pragma once

#include <string>
#include <string_view>

#include "app/measure/table/csv.h"
#include "app/measure/table/table_header.h"

namespace plumbline::measure {

/// The number in a field; infinity if it is not a number.
double NumberOrInfinity(std::string_view field);

/// Why a row whose field `camera` names none cannot be used; without the field.
inline constexpr std::string_view kNotACamera =
    "is not a camera: write side, rear, front or top, or two of them joined by + for their mean";

/// Parses a field and stores it in the row, in SI units. Empty cells of a measured table are stored
/// as NaN for FillEmptyCells().
/// @param row  has its vectors at their sizes; positions and orientations start at zero
/// @return     why the row cannot be used with this field, or an empty string
std::string StoreField(const Column& column, std::string_view field, TableUse use,
                       MeasuredRow& row);

}  // namespace plumbline::measure
