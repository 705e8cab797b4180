// Shape search for the time constant of thermal drift.
#pragma once

#include "app/measure/diagnosis/shape_search.h"

namespace plumbline::measure {

/// For `thermal_drift`: proposes the two best time constants between 1/40 and 5 times the recorded
/// time span. An explanation contains at most one, since the sum of two exponentials is hardly
/// distinguishable from one.
const ShapeSearch& ThermalDriftSearch();

}  // namespace plumbline::measure
