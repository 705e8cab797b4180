// Journal of probes together with the drift monitor that follows its rows.
#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "app/base/config/daemon_config.h"
#include "app/base/log/log_entry.h"
#include "app/cell/daemon/cycle_mailboxes.h"
#include "app/cell/daemon/row_drift_monitor.h"
#include "app/cell/daemon/state_storage.h"
#include "app/cell/journal/journal.h"
#include "app/cell/model_store/model_store.h"

namespace plumbline::cell {

/// Writes each probe to the journal and passes it to the drift monitor. The monitor's state is not
/// stored: whenever the journal is opened, it is recomputed from the rows since the model in force
/// was applied, or since a person restarted the monitor. After an error the journal is closed, and
/// opened again later. Used by one thread.
class MonitoredJournal {
 public:
  /// @param config, models  in force; after a change call Reconfigure()
  /// @param step            progress callback, called between steps that take about a second
  /// @param storage         checked after a failed write; if nullptr, the directory is assumed to
  ///                        be writable
  MonitoredJournal(const config::DaemonConfig& config, const ModelState& models, log::LogSink sink,
                   std::function<void()> step, StateStorage* storage);

  /// Reads the journal again under another configuration or model; closes it if monitoring is off.
  void Reconfigure();
  /// Opens it if that failed some seconds ago.
  void OpenIfDue();
  /// Lets the next OpenIfDue() open it at once.
  void RetryAtOnce() { tried_ = {}; }
  /// Stops writing to a journal file that was moved away; a new one is created in its place.
  void CloseIfMoved();

  /// Records a probe, or restarts the monitor.
  /// @return  false if the event could not be written and must be passed again
  bool Handle(const CycleEvent& event);

  /// Whether persons have accepted or rejected quarantined rows since the journal was read; then
  /// Reread() is to be called. Accepted rows take their place in time order.
  bool WasDecided();
  void Reread();

  /// nullptr while it is closed.
  Journal* journal() { return journal_ ? &*journal_ : nullptr; }
  std::uint32_t recorded() const { return recorded_; }  ///< probes written since the start
  /// What calls for the diagnosis: the drift alarm, or a reference that contradicts the radius.
  /// Requires a journal.
  std::string DiagnosisCause() const;

  /// Number of probes since those that raised the drift alarm, or in which the reference
  /// contradicts the radius; 0 if neither awaits a diagnosis.
  std::uint64_t ProbesForDiagnosis() const;
  /// Whether the present finding needs no diagnosis, because one was started or a proposal waits.
  void SetFindingHandled(bool handled) { finding_handled_ = handled; }

  /// Sets what the journal and the monitor know.
  void Report(status::MonitoringStatus& status) const;

 private:
  using Clock = std::chrono::steady_clock;

  void Open(std::optional<Journal> open = std::nullopt);
  void Close();
  Result<Journal> OpenFile();
  Result<void> Read(std::optional<Journal> open);
  bool RadiusContradicted() const;
  Result<void> ReadRows(Journal& journal);
  Result<void> LogRead();
  bool Record(const CycleEvent& event);
  bool RestartMonitor(const char* reason);
  void UpdateMonitor(const JournalRow& row, bool replayed);
  void LogAlarm();
  void LogQuarantined(const JournalRow& row);
  void CheckStorage();
  void ReportFault(const std::string& what);
  void ReportRecovery();

  const config::DaemonConfig& config_;
  const ModelState& models_;
  log::LogSink sink_;
  std::function<void()> step_;
  StateStorage* const storage_;

  std::optional<Journal> journal_;
  std::optional<RowDriftMonitor> monitor_;
  Clock::time_point tried_, decisions_read_, storage_checked_;
  /// The cameras at the start: a reload does not change them.
  std::optional<std::vector<config::CameraConfig>> cameras_;
  bool finding_handled_ = false;
  /// Whether the radius was contradicted when the journal was closed: what is known while the rows
  /// cannot be read. A radius that probes contradicted must not be stated as 95 % again.
  bool contradicted_ = false;
  bool alarm_unlogged_ = false;     ///< raised by a reread row; not logged yet
  std::int64_t quarantined_ = 0;    ///< rows of the journal that await a person's decision
  std::int64_t last_decision_ = 0;  ///< id of the newest decision that was followed
  bool decision_unlogged_ = false;  ///< decision not logged yet: the journal must be reread first
  std::string decisions_fault_;     ///< why decisions cannot be read; empty if they can
  bool quarantining_ = false;       ///< the newest probe was quarantined, and that was logged
  std::string fault_;               ///< empty: none
  std::uint32_t recorded_ = 0;
  Vec3 last_residual_m_ = Vec3::Zero();
};

}  // namespace plumbline::cell
