// A view state as text and back.
#pragma once

#include <string>
#include <string_view>

#include "app/view_link/view_state.h"
#include "firmware-like/result.h"

namespace plumbline {

/// Raised with every change that an older reader would misunderstand.
inline constexpr int kViewSchema = 5;

/// One JSON object. Numbers that are not finite become null.
std::string JsonOfView(const ViewState& state);

/// @return  or what is wrong with the text: another schema, a missing or senseless value. Never
///          throws, whatever the text.
Result<ViewState> ViewOfJson(std::string_view text);

}  // namespace plumbline
