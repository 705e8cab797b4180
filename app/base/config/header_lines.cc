#include "app/base/config/header_lines.h"

#include <algorithm>

namespace plumbline::config {
namespace {

bool IsOfName(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
         c == '-' || c == '.';
}

/// Length of the header that the text starts with; 0 if it starts with none.
std::size_t HeaderSize(std::string_view text) {
  const std::size_t brackets = text.starts_with("[[") ? 2 : 1;
  if (!text.starts_with('[')) return 0;
  std::size_t end = brackets;
  while (end < text.size() && IsOfName(text[end])) ++end;
  if (end == brackets || text.substr(end, brackets) != std::string(brackets, ']')) return 0;
  return end + brackets;
}

}  // namespace

std::vector<HeaderLine> HeaderLines(std::string_view text) {
  std::vector<HeaderLine> found;
  int number = 0;
  for (std::size_t begin = 0; begin < text.size();) {
    ++number;
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const std::string_view line = text.substr(begin, end - begin);
    const std::size_t bracket = std::min(line.find_first_not_of("# \t"), line.size());
    // An indented comment continues that of the line above and may mention a header.
    const std::size_t signs = std::min(line.find_first_not_of('#'), bracket);
    const bool mentioned = line.substr(signs, bracket - signs).find('#') != std::string_view::npos;
    const std::size_t size = mentioned ? 0 : HeaderSize(line.substr(bracket));
    const std::size_t next = line.find_first_not_of(" \t\r", bracket + size);
    if (size > 0 && (next == std::string_view::npos || line[next] == '#')) {
      found.push_back(
          {number, signs > 0, std::string(line.substr(bracket, size)), begin, begin + bracket});
    }
    begin = end + 1;
  }
  return found;
}

std::string WithHeader(std::string_view text, const HeaderLine& header) {
  std::string changed(text);
  std::fill_n(changed.begin() + static_cast<std::ptrdiff_t>(header.begin),
              header.bracket - header.begin, ' ');
  return changed;
}

}  // namespace plumbline::config
