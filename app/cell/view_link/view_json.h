// JSON codec of the view state.
#pragma once

#include <string>
#include <string_view>

#include "app/cell/view_link/view_state.h"
#include "firmware-like/result.h"

namespace plumbline::cell {

/// Incremented with every change that an older reader would misinterpret.
inline constexpr int kViewSchema = 10;

/// @return  one JSON object without the points; non-finite numbers become null
std::string JsonOfView(const ViewState& state);
/// @return  the points as one JSON list
std::string JsonOfPoints(const std::vector<ViewPoint>& points);

/// Parses untrusted text; never throws.
/// @return  the value, or what is wrong: another schema, a missing or implausible value
Result<ViewState> ViewOfJson(std::string_view text);
Result<std::vector<ViewPoint>> PointsOfJson(std::string_view text);

}  // namespace plumbline::cell
