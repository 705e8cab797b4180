// From a probe of the cycle to a row of the journal.
#pragma once

#include <string>

#include "app/config/camera_config.h"
#include "app/daemon/loop_link.h"
#include "app/journal/journal_row.h"

namespace plumbline {

/// @param cameras  that are configured, whose names a probe by camera carries
JournalRow RowOfProbe(const LoopEvent& event, const std::string& session, double epoch_utc_s,
                      const std::vector<CameraConfig>& cameras);

/// A tip by camera whose largest deviation is above that of the other probes: it is kept, but would
/// alarm for its own noise.
bool IsCoarse(const JournalRow& row, double probe_sigma_m);

/// Measured and predicted, finite, not coarse.
bool MayBeJudged(const JournalRow& row, double probe_sigma_m);

}  // namespace plumbline
