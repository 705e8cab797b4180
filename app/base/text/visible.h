// Text from files and devices, made harmless for terminals and logs.
#pragma once

#include <string>
#include <string_view>

namespace plumbline::text {

/// The text with every character that a terminal would execute or reorder by written as \u001b:
/// control characters except tab and line feed, DEL, C1 controls, line and paragraph separators,
/// and bidirectional overrides and isolates. Bytes that are not valid UTF-8 become \x9b. Inside a
/// JSON string the meaning does not change. Other text stays as it is.
std::string Visible(std::string_view text);

}  // namespace plumbline::text
