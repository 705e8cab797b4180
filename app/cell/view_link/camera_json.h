// JSON of a camera in a view state: status, image, lens, tags and bodies.
#pragma once

#include "app/cell/view_link/json_values.h"
#include "app/cell/view_link/view_state.h"

namespace plumbline::cell {

Json CameraJson(const ViewCamera& camera);

/// @param json  untrusted
/// @throws      std::exception that says which value is missing or implausible
ViewCamera CameraOf(const Json& json);

}  // namespace plumbline::cell
