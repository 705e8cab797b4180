// JSON codec of the view state.
#pragma once

#include <string>
#include <string_view>

#include "app/view_link/view_state.h"
#include "firmware-like/result.h"

namespace plumbline::view_link {

/// Incremented with every change that an older reader would misinterpret.
inline constexpr int kViewSchema = 7;

/// @return  one JSON object; non-finite numbers become null
std::string JsonOfView(const ViewState& state);

/// Parses untrusted text; never throws.
/// @return  the state, or what is wrong: another schema, a missing or implausible value
Result<ViewState> ViewOfJson(std::string_view text);

}  // namespace plumbline::view_link
