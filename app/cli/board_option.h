// A board on the command line: the options that name it, shared by the commands that look for one.
#pragma once

#include <string>

#include "app/lens/board.h"

namespace CLI {
class App;
}

namespace plumbline {

/// As typed.
struct BoardOptions {
  std::string kind = "chessboard", points = "17x11", family = Board{}.family;
  double square_mm = 10, mark_mm = 0;
};

/// Adds --board-kind, --board, --square-mm, --mark-mm and --family.
void AddBoardOptions(CLI::App& command, BoardOptions& options);

/// The board that they name, once the command line was taken.
Board BoardOf(const BoardOptions& options);
/// Which option makes it no board, and what to write in its place; empty where none does.
std::string WhyNoBoard(const Board& board);

}  // namespace plumbline
