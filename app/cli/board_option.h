// Command line options that describe a calibration board and the camera that sees it, shared by
// several commands.
#pragma once

#include <string>

#include "app/lens/board.h"
#include "app/lens/declared_facts.h"

namespace CLI {
class App;
}

namespace plumbline::cli {

/// The option values as entered.
struct BoardOptions {
  std::string kind = "chessboard", points = "17x11", family = lens::Board{}.family;
  double square_mm = 10, mark_mm = 0;
};

/// Adds --board-kind, --board, --square-mm, --mark-mm and --family.
void AddBoardOptions(CLI::App& command, BoardOptions& options);

/// Adds --no-window and --fixed-focus.
void AddDeclarationOptions(CLI::App& command, lens::DeclaredFacts& declared);

/// The board described by the options, which must have been parsed.
lens::Board BoardOf(const BoardOptions& options);
/// Error message with the option that makes the board invalid and the requirement; empty if it is
/// valid.
std::string BoardOptionProblem(const lens::Board& board);

}  // namespace plumbline::cli
