// Evidence about which rows of two files belong together, where no column is common to both.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/measure/imports/import_table.h"

namespace plumbline::measure {

/// Which row of the joints belongs to each measured row, and what says so.
struct RowPairing {
  std::vector<std::size_t> joints_row;  ///< by measured row, from 0
  std::string evidence;                 ///< "row", or the columns that decided
};

/// Pairs the rows of two files with equally many of them.
///
/// Numbers (a column of numbers, or names that end in different numbers) and times each order the
/// rows of a file; a file that has neither is taken to be in that order already, as a controller's
/// record is. Then:
///   - nothing contradicts the order of the rows: by row
///   - times of both files, put in order, differ by the same amount in each pair, to less than half
///     of the shortest interval: by time, whatever else the files say
///   - numbers and times agree on another order: by them
///   - anything else: a fault. One column alone, in one file only, is not enough: the numbers may
///   be
///     places in the other file, or names that were given in another order.
/// @param faults  receives the fault, if the result is nullopt
std::optional<RowPairing> PairingOf(const ImportedTable& measured, const ImportedTable& joints,
                                    const std::string& joints_file, config::FaultList& faults);

}  // namespace plumbline::measure
