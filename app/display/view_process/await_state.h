// Waiting for a current state and its scene measurements, for programs that run once.
#pragma once

#include "app/display/view_process/viewer.h"

namespace plumbline::display {

/// @return  false if no state arrived in time; the viewer's link_problem gives the reason
bool AwaitState(Viewer& viewer, double timeout_s);

/// Waits up to `meshes_timeout_s` for the object table and its meshes, then for a current state
/// and its measurements. Meshes that take longer are left out.
void AwaitMeasured(Viewer& viewer, double meshes_timeout_s);

}  // namespace plumbline::display
