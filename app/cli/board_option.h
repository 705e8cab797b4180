// Command line options that describe a calibration board and the camera that sees it, shared by
// several commands.
#pragma once

#include <string>

#include "app/base/target/board.h"
#include "app/base/target/declared_facts.h"

namespace CLI {
class App;
}

namespace plumbline::cli {

/// The option values as entered.
struct BoardOptions {
  std::string kind = "chessboard", points = "17x11", family = target::Board{}.family;
  double square_mm = 10, mark_mm = 0;
};

/// Adds --board-kind, --board, --square-mm, --mark-mm and --family.
void AddBoardOptions(CLI::App& command, BoardOptions& options);

/// Adds --no-window and --fixed-focus.
void AddDeclarationOptions(CLI::App& command, target::DeclaredFacts& declared);

/// The board described by the options, which must have been parsed.
target::Board BoardOf(const BoardOptions& options);
/// Error message with the option that makes the board invalid and the requirement; empty if it is
/// valid.
std::string BoardOptionProblem(const target::Board& board);

}  // namespace plumbline::cli
