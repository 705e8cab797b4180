#include "app/cli/board_option.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <optional>
#include <string_view>
#include <utility>

#include "app/base/target/tag_family.h"
#include "app/cli/number_option.h"

namespace plumbline::cli {
namespace {

/// Columns and rows of "17x11", or nullopt.
std::optional<std::pair<int, int>> PointsFromText(std::string_view text) {
  int columns = 0, rows = 0;
  const char* end = text.data() + text.size();
  const auto [x, first] = std::from_chars(text.data(), end, columns);
  if (first != std::errc() || x == end || (*x != 'x' && *x != 'X')) return std::nullopt;
  const auto [rest, second] = std::from_chars(x + 1, end, rows);
  if (second != std::errc() || rest != end) return std::nullopt;
  return std::pair(columns, rows);
}

std::string BoardProblem(const std::string& text) {
  if (PointsFromText(text)) return {};
  return fmt::format(
      "{} is not COLUMNSxROWS, such as 17x11 inner corners for a chessboard of 18 x 12 squares",
      text);
}

}  // namespace

void AddBoardOptions(CLI::App& command, BoardOptions& options) {
  command
      .add_option("--board-kind", options.kind,
                  "Kind of board; acircles: circles with every other row shifted")
      ->capture_default_str()
      ->check(CLI::IsMember({"chessboard", "charuco", "circles", "acircles"}));
  command
      .add_option("--board", options.points,
                  "COLUMNSxROWS: inner corners (chessboard, ChArUco) or circles")
      ->capture_default_str()
      ->check(CLI::Validator([](const std::string& text) { return BoardProblem(text); }, ""));
  command
      .add_option("--square-mm", options.square_mm,
                  "Side of a square, or row spacing of the circles")
      ->capture_default_str()
      ->check(NumberWithin(0.01, 10000));
  command
      .add_option("--mark-mm", options.mark_mm,
                  "Side of a ChArUco tag including its black border, or diameter of the circles")
      ->check(NumberWithin(0.01, 10000));
  command
      .add_option("--family", options.family,
                  "Family of a ChArUco board's tags, one of " + target::TagFamilyNames())
      ->capture_default_str();
}

void AddDeclarationOptions(CLI::App& command, target::DeclaredFacts& declared) {
  command.add_flag(
      "--no-window", declared.no_window,
      "Declare that no pane of glass is in front of the lens: no window, door or filter");
  command.add_flag("--fixed-focus", declared.fixed_focus,
                   "Declare that the focal length is the same in all images: no autofocus, no zoom "
                   "drive that moves by itself");
  command.add_flag("--oblong-pixels", declared.oblong_pixels,
                   "Declare that the pixels are not square, as those of a camera with an analogue "
                   "signal or a scaled image");
}

target::Board BoardOf(const BoardOptions& options) {
  const auto points = PointsFromText(options.points);
  return {points->first,
          points->second,
          1e-3 * options.square_mm,
          *target::BoardKindOfName(options.kind),
          1e-3 * options.mark_mm,
          options.family};
}

std::string BoardOptionProblem(const target::Board& board) {
  const auto fault = FaultOf(board);
  if (!fault) return {};
  std::string option(fault->key == "columns" ? "board" : fault->key);
  std::replace(option.begin(), option.end(), '_', '-');
  return fmt::format("--{}: {}", option, fault->message);
}

}  // namespace plumbline::cli
