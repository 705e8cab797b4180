// Sheet with a calibration board to scale.
#pragma once

#include <string>
#include <vector>

#include "app/base/target/board.h"
#include "app/vision/print/paper.h"
#include "firmware-like/result.h"

namespace plumbline::vision {

/// Lays out a board on one sheet, in portrait or landscape. The top left square is black; the tags
/// of a ChArUco board are upright. A chessboard has a white mark in that square.
/// @param board  valid: FaultOf(board) is nullopt
/// @return       the sheet, or an error that names the largest square that fits
Result<Document> BoardSheet(const target::Board& board, const Paper& paper);

/// The table [board] of plumbline.toml for this board.
std::vector<std::string> BoardLines(const target::Board& board);

}  // namespace plumbline::vision
