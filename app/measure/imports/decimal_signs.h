// Decimal signs of the columns of a file, and values that two signs would read differently.
#pragma once

#include <set>

#include "app/measure/imports/import_table.h"

namespace plumbline::measure {

/// Compares the columns that hold numbers with the decimal sign of the file, D; O is the other
/// sign. "1089,658" or "0,5" cannot have thousands separators, so that its comma is a decimal sign;
/// "81,410" may be 81.41 or 81410.
/// @param stated  the user stated D; a value that allows both signs then has thousands separators,
///                unless another value of its column can only have O as its decimal sign
/// @param faults  receives one fault if columns have O as their decimal sign, and one if a column
///                has values that allow both signs and none that proves thousands separators
/// @return        columns of which every value that allows both signs must be rejected
std::set<std::size_t> CheckDecimalSigns(const UnderstoodFile& file, bool stated,
                                        config::FaultList& faults);

}  // namespace plumbline::measure
