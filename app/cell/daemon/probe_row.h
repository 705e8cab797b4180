// Conversion of the control cycle's probes to journal rows, and their use for monitoring.
#pragma once

#include <string>

#include "app/base/config/camera_config.h"
#include "app/cell/daemon/cycle_mailboxes.h"
#include "app/cell/journal/journal_row.h"

namespace plumbline::cell {

/// @param epoch_utc_s  the journal's epoch, UTC seconds since 1970
/// @param artefacts    of the cell, whose names are recorded with a probe on one
/// @param cameras      the configured cameras, whose names are recorded with a camera probe
JournalRow JournalRowFromProbe(const CycleEvent& event, const std::string& session,
                               double epoch_utc_s, const std::vector<model::Artefact>& artefacts,
                               const std::vector<config::CameraConfig>& cameras);

/// Whether a camera probe's largest standard deviation exceeds that of other probes [m]. Such a
/// probe is recorded, but its noise alone would raise drift alarms.
bool IsTooUncertain(const JournalRow& row, double probe_sigma_m);

/// Whether the drift monitor may use the row: measured and predicted, finite, not too uncertain.
bool IsUsableForMonitoring(const JournalRow& row, double probe_sigma_m);

}  // namespace plumbline::cell
