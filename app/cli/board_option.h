// A chessboard on the command line: COLUMNSxROWS of inner corners.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>

namespace plumbline {

/// "17x11", or nothing.
std::optional<std::pair<int, int>> CornersFromText(std::string_view text);

/// What is wrong with it, for the one who typed it; empty where nothing is.
std::string BoardProblem(const std::string& text);

}  // namespace plumbline
