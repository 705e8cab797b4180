// Set-up of the control cycle's parts, and of the first register image, from a configuration.
#pragma once

#include <cstdint>
#include <memory>

#include "app/cell/daemon/control_cycle.h"
#include "app/cell/daemon/model_in_force.h"

namespace plumbline::cell {

/// Logs why there are none.
/// @param in_use  the present parts, whose robot link is reused if its settings have not changed;
///                nullptr at the start
/// @return        nullptr if the model or the robot cannot be used
std::unique_ptr<CycleParts> PartsFrom(const ConfigInForce& in_force, const CycleParts* in_use);

/// Waits for the branches of taught points, but not for long: the PLC server of a cell with many
/// points opens without them.
void AwaitBranches(CycleParts& parts);

/// The image that clients read before the first cycle: it has the identity of this start and all
/// points, none of them valid. Runs a cycle of the machine without inputs.
modbus::RegisterImage FirstImage(CycleParts& parts, std::uint16_t boot_count);

}  // namespace plumbline::cell
