// One diagnosis of journal rows, from the export to the proposed model.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/base/config/daemon_config.h"
#include "app/base/log/log_entry.h"
#include "app/cell/journal/journal.h"
#include "app/cell/model_store/model_store.h"
#include "drivers/os/child_process.h"
#include "firmware-like/result.h"

namespace plumbline::cell {

// The diagnosis as a child process at low priority.

/// One run of a program in its own process group, at nice 19, with standard output and error going
/// to a file. The destructor kills the group; the kernel kills the program when the thread that
/// started it ends, however that happens.
class DiagnosisProcess {
 public:
  /// @param arguments  the program's path first
  static Result<DiagnosisProcess> Start(const std::vector<std::string>& arguments,
                                        const std::string& output_file);

  /// nullopt while it runs; then the reason of its failure, empty for exit code 0.
  std::optional<std::string> Poll();
  void Kill() { child_.End(); }

 private:
  DiagnosisProcess(os::ChildProcess child, std::string output_file)
      : child_(std::move(child)), output_file_(std::move(output_file)) {}
  os::ChildProcess child_;
  std::string output_file_;
};

/// Runs `plumbline diagnose` as a child process over the rows recorded since the current model came
/// into force, then proposes the corrected model, and applies it if the configuration allows that.
/// Its files remain in STATE/diagnosis until the next run.
class DiagnosisRun {
 public:
  /// Exports the rows and starts the process. Logs what was left out, and which effects coarse
  /// joint registers hide.
  /// @param cause  what called for it: the drift alarm of a row, or a reference
  /// @param step       progress callback, called between steps that take about a second in total
  static Result<DiagnosisRun> Start(const config::DaemonConfig& config, int applied_model,
                                    Journal& journal, std::string cause, const log::LogSink& sink,
                                    const std::function<void()>& step);

  struct Outcome {
    std::string message;  ///< the line to log
    std::string failure;  ///< empty: none
    int proposed = 0;     ///< version of the model; 0: none
    bool applied = false;
  };
  /// nullopt while it runs; not to be called again after an outcome.
  /// @param config  the configuration in force now, whose limits apply
  /// @param step    progress callback, called between the steps that turn a finished diagnosis into
  ///                a proposal; with many points they take seconds in total
  std::optional<Outcome> Poll(const config::DaemonConfig& config,
                              const std::function<void()>& step);

 private:
  using Clock = std::chrono::steady_clock;
  DiagnosisRun(DiagnosisProcess process, int applied_model, std::string cause,
               std::vector<JournalRow> rows)
      : process_(std::move(process)),
        applied_model_(applied_model),
        cause_(std::move(cause)),
        rows_(std::move(rows)) {}
  Result<Outcome> Propose(const config::DaemonConfig& config,
                          const std::function<void()>& step) const;

  DiagnosisProcess process_;
  Clock::time_point started_ = Clock::now();
  int applied_model_;
  std::string cause_;
  std::vector<JournalRow> rows_;
};

/// Why a model needs a person's approval although monitoring.apply is "automatic"; empty if it does
/// not.
/// @param has_points  whether points are configured, so that their displacement counts, too
std::string AutomaticApplyObjection(const ModelFacts& facts,
                                    const config::MonitoringConfig& monitoring, bool has_points);

}  // namespace plumbline::cell
