// Rows that lack a signal which others have: the last move, velocities, accelerations.
#pragma once

#include <cstddef>
#include <vector>

#include "app/diagnosis/diagnosis.h"
#include "firmware-like/effects/effect.h"

namespace plumbline {

/// A signal that some rows lack.
struct LackedSignal {
  Signal signal = Signal::kOrder;
  std::vector<std::size_t> rows;  ///< of the table, ascending
};

/// The signals that are recorded, but not in every row. A session's first row lacks its last move
/// by nature and is not counted.
std::vector<LackedSignal> LackedSignals(const CellModel& cell, const MeasuredTable& table);

/// The table with some of its rows set aside: they keep their place in the order of moves.
MeasuredTable WithRowsAside(const MeasuredTable& table, const std::vector<std::size_t>& rows);

/// True where an effect of the answer, named or in its discrepancy model, needs one of these
/// signals.
bool Needs(const Diagnosis& diagnosis, const std::vector<LackedSignal>& lacked);

}  // namespace plumbline
