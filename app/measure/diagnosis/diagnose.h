// Entry point of the diagnosis, and rows without a signal that other rows have.
#pragma once

#include <cstddef>
#include <vector>

#include "app/measure/diagnosis/result/diagnosis.h"
#include "firmware-like/effects/effect.h"

namespace plumbline::measure {

/// Identifies the effects that the declared cell lacks. Deterministic: equal input gives an equal
/// answer. If some rows lack a signal that others have (the last move after a lost line,
/// velocities), the complete rows are diagnosed first; the others take part as well unless the
/// answer depends on that signal (DependsOn).
/// @return  an error with advice if the data cannot be used at all; the caller adds the file name
Result<Diagnosis> Diagnose(const model::CellModel& cell, MeasuredTable measured,
                           const DiagnosisOptions& options);

/// Like Diagnose, with all rows at once: an effect is zero in rows that lack its signal.
Result<Diagnosis> DiagnoseRows(const model::CellModel& cell, const MeasuredTable& measured,
                               const DiagnosisOptions& options);

// Rows without a signal that other rows have: the last move, velocities or accelerations.

/// A signal that is missing in some rows.
struct MissingSignal {
  effects::Signal signal = effects::Signal::kOrder;
  std::vector<std::size_t> rows;  ///< indices into the table, ascending
};

/// Signals that are recorded, but not in every row. The first row of a session never has a last
/// move and is not counted.
std::vector<MissingSignal> LackedSignals(const model::CellModel& cell, const MeasuredTable& table);

/// The table with some of its rows moved to `unmeasured`, where they still count as moves in their
/// original order.
/// @param rows  indices into the table, ascending
MeasuredTable ExcludeRows(const MeasuredTable& table, const std::vector<std::size_t>& rows);

/// True if an effect of the answer, named or in its discrepancy model, depends on one of these
/// signals.
bool DependsOn(const Diagnosis& diagnosis, const std::vector<MissingSignal>& lacked);

}  // namespace plumbline::measure
