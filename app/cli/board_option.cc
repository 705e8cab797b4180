#include "app/cli/board_option.h"

#include <fmt/format.h>

#include <charconv>

namespace plumbline {
namespace {

constexpr int kLeastCorners = 3, kMostCorners = 100;

}  // namespace

std::optional<std::pair<int, int>> CornersFromText(std::string_view text) {
  int columns = 0, rows = 0;
  const char* end = text.data() + text.size();
  const auto [x, first] = std::from_chars(text.data(), end, columns);
  if (first != std::errc() || x == end || (*x != 'x' && *x != 'X')) return std::nullopt;
  const auto [rest, second] = std::from_chars(x + 1, end, rows);
  if (second != std::errc() || rest != end || columns < kLeastCorners || rows < kLeastCorners ||
      columns > kMostCorners || rows > kMostCorners)
    return std::nullopt;
  return std::pair(columns, rows);
}

std::string BoardProblem(const std::string& text) {
  if (CornersFromText(text)) return {};
  return fmt::format(
      "{} is not COLUMNSxROWS of inner corners, {} to {} each, such as 17x11 for a board of 18 x "
      "12 "
      "squares",
      text, kLeastCorners, kMostCorners);
}

}  // namespace plumbline
