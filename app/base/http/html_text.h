// Text for HTML.
#pragma once

#include <string>
#include <string_view>

namespace plumbline::http {

/// The text with & < > " ' as character references, for use between tags and in quoted attributes;
/// control characters except tab and line feed become U+FFFD.
std::string EscapedHtml(std::string_view text);

/// The address if it is an absolute http or https URL of printable ASCII without quotes, brackets
/// or backslashes, else empty: what a browser would not run as a script. Escape it nevertheless.
std::string WebAddress(std::string_view text);

}  // namespace plumbline::http
