// Detection of columns whose unit changes within the table, from their numbers alone.
#pragma once

#include <vector>

#include "app/measure/diagnosis/mistakes.h"

namespace plumbline::measure {

/// Unit changes that are visible in a column's numbers alone: of the payload (pounds, grams), if
/// the rows on one side of the change, converted, repeat the payloads of the other side; of a
/// revolute joint (radians), if no angle on one side exceeds a turn in radians and those of the
/// other side do by far. Each is subtle (Mistake::subtle): a light payload, or a joint whose axis
/// passes through the tool, moves the tip by less than effects do.
std::vector<Mistake> UnitChanges(const Dataset& data);

}  // namespace plumbline::measure
