// Detection of a change of the payload's unit within the table: converted, the values repeat those
// of the other rows.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/measure/diagnosis/mistakes.h"

namespace plumbline::measure {

/// Payloads in pounds or grams on one side of a change. Requires recorded payloads.
std::vector<Mistake> PayloadUnitChanges(const Dataset& data);

/// Detects payloads entered in grams: read as kilograms, they exceed what any robot carries. The
/// reader has excluded their rows (MeasuredTable::excessive_payloads).
/// @return  a sentence with the evidence and a remedy
std::optional<std::string> PayloadsInGrams(const MeasuredTable& table);

}  // namespace plumbline::measure
