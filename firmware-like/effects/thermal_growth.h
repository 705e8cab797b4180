// Thermal growth: links that expand with temperature.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

/// a_i and d_i are multiplied by 1 + alpha (T - T_ref), with T the row's temp_C and T_ref the
/// cell's reference temperature; centres of mass and the tool are unchanged   [formats.md]. Unit:
/// 1/K. Steel 12e-6, aluminium 23e-6. Adds nothing if either temperature is unknown. Valid if the
/// whole arm is at the sensor's temperature.
const Effect& ThermalGrowth();

}  // namespace plumbline::effects
