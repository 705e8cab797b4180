// Drift monitor over rows of the journal, with the log entries about its findings.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "app/base/config/camera_config.h"
#include "app/base/config/monitoring_config.h"
#include "app/base/log/log_entry.h"
#include "app/cell/daemon/cycle_mailboxes.h"
#include "app/cell/journal/journal.h"
#include "app/cell/journal/journal_row.h"
#include "firmware-like/monitor/drift_monitor.h"

namespace plumbline::cell {

// Conversion of the control cycle's probes to journal rows, and their use for monitoring.

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

/// The monitor's verdict on one row.
struct RowVerdict {
  bool outlier = false;
  bool raised = false;              ///< this row raised the alarm
  bool reference_complete = false;  ///< with this row the reference was learned or refused
};

/// Selects the rows that the drift monitor may compare, and keeps track of which row each of its
/// probes came from.
///
/// Of the probes measured by cameras, only those of one camera are monitored, that of the first
/// such row: errors of the tags' declared positions are the same in every probe of one camera, but
/// differ between cameras.
class RowDriftMonitor {
 public:
  /// @param sink  receives one entry for each camera whose probes are not monitored
  /// @param step  progress callback, called between steps that take about a second in total
  RowDriftMonitor(const config::MonitoringConfig& config, log::LogSink sink,
                  const std::function<void()>& step);

  /// Discards everything, including the reference and its camera, except radius_contradicted().
  void Restart();

  /// Processes a row; rows arrive in ascending id.
  /// @param replayed  read from the journal; then nothing is logged
  /// @return          nullopt for a row that is not monitored
  std::optional<RowVerdict> Update(const JournalRow& row, bool replayed);

  /// Whether the last reference that was complete contradicts the radius stated for its probes:
  /// their mean is farther from the model than that radius explains.
  bool radius_contradicted() const { return radius_contradicted_; }
  /// Whether it is the present reference that does; else the one before the restart did.
  bool contradicted_by_reference() const {
    // Where the model is the reference, no probes were taken for one.
    return radius_contradicted_ && drift_.design().reference_probes > 0 && !drift_.learning() &&
           !drift_.reference_refused();
  }
  /// As it was before a restart that the journal records.
  void SetRadiusContradicted(bool contradicted) { radius_contradicted_ = contradicted; }
  /// "journal rows 4 to 23", or "no journal rows" before any probe of a reference.
  std::string ReferenceRows() const;

  const monitor::DriftMonitor& drift() const { return drift_; }
  std::int64_t alarm_row() const { return alarm_row_; }  ///< the row that raised the alarm; 0: none

  /// The reference that was learned, or why it was refused and which rows disagree.
  log::LogEntry ReferenceEntry() const;
  /// By how much the reference contradicts the radius. Requires a complete reference.
  log::LogEntry ContradictionEntry() const;
  /// The shift that raised the alarm: the median over the rows that contributed, because the
  /// monitor's own estimate limits the influence of each probe and so underestimates shifts of
  /// several millimetres. If the rows cannot be read, the monitor's estimate. Requires an alarm.
  /// @param journal  from which the monitored rows came
  /// @param joints   of the cell
  log::LogEntry AlarmEntry(Journal& journal, const std::vector<model::Joint>& joints,
                           int model_version) const;

 private:
  void JudgeRadius();
  bool MatchesReference(const JournalRow& row, bool replayed);
  Vec3 MedianShift(Journal& journal, const std::vector<model::Joint>& joints,
                   int model_version) const;

  log::LogSink sink_;
  double probe_sigma_m_;
  monitor::DriftMonitor drift_;
  std::optional<std::string> reference_camera_;  ///< nullopt before the first row by a camera
  std::set<std::string> unmonitored_cameras_;    ///< cameras logged as not monitored
  std::vector<std::int64_t> monitored_rows_;     ///< ascending
  std::int64_t alarm_row_ = 0;
  bool radius_contradicted_ = false;
};

}  // namespace plumbline::cell
