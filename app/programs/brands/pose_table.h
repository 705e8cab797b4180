// Tables of poses that off-line programming systems export.
#pragma once

#include <span>

#include "app/programs/brand.h"

namespace plumbline::programs {

/// Delimited text (.csv, .tsv, .txt) with one pose or posture a line, understood by the names of
/// its columns (pose_table_layout.h); a table without them, or with ambiguous ones, is refused. A
/// brand for each way to write a pose, because each has its own conventions.
///
/// Every line is a linear motion in the order of the file. Columns tool, base and load select
/// "tool X", "base X" and "load X"; joints beside a pose are the posture near which it is reached.
std::span<const Brand* const> PoseTables();

}  // namespace plumbline::programs
