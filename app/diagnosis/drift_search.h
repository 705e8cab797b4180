// Time constants of a base that moves as the cell warms up.
#pragma once

#include "app/diagnosis/shape_search.h"

namespace plumbline {

/// Of `thermal_drift`: time constants from a fortieth of the recorded time to five times of it, the
/// best two. Two exponentials are one with another time constant, or something else: an explanation
/// has one.
const ShapeSearch& ThermalDriftSearch();

}  // namespace plumbline
