// JSON of a camera in a view state: status, image, lens, tags and bodies.
#pragma once

#include "app/view_link/json_values.h"
#include "app/view_link/view_state.h"

namespace plumbline::view_link {

Json CameraJson(const ViewCamera& camera);

/// @param json  untrusted
/// @throws      std::exception that says which value is missing or implausible
ViewCamera CameraOf(const Json& json);

}  // namespace plumbline::view_link
