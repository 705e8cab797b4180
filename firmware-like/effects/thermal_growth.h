// Links that grow with the temperature.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline {

/// a_i and d_i times 1 + alpha (T - T_ref), T the row's temp_C and T_ref the cell's reference
/// temperature; centres of mass and tool keep their size   [formats.md]. Unit: 1/K. Steel 12e-6,
/// aluminium 23e-6. Nothing where either temperature is unknown. Valid for an arm that is as warm
/// as the sensor says, everywhere.
const Effect& ThermalGrowth();

}  // namespace plumbline
