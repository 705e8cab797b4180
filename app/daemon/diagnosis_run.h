// One diagnosis of the journal's rows: from the export to the proposal.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "app/config/daemon_config.h"
#include "app/daemon/diagnosis_process.h"
#include "app/journal/journal.h"
#include "app/log/log_entry.h"
#include "app/model_store/model_store.h"

namespace plumbline {

/// `plumbline diagnose` over the rows since the model in force came into force, as a child process;
/// then its corrected model as a proposal, applied where the configuration says so. Its files stand
/// in STATE/diagnosis until the next one.
class DiagnosisRun {
 public:
  /// Exports the rows and starts the process; says what was left out, and what coarse joint
  /// registers hide.
  /// @param alarm_row  the reason: a row of the journal
  /// @param step       called between its steps, which take a second together
  static Result<DiagnosisRun> Start(const DaemonConfig& config, int applied_model, Journal& journal,
                                    std::int64_t alarm_row, const LogSink& sink,
                                    const std::function<void()>& step);

  struct Outcome {
    std::string told;     ///< the line to log
    std::string failure;  ///< empty: none
    int proposed = 0;     ///< version of the model; 0: none
    bool applied = false;
  };
  /// Nothing while it runs; asked no more after an outcome.
  /// @param config  in force now: its limits hold
  /// @param step    called between the steps that turn a finished diagnosis into a proposal; they
  ///                take seconds together where there are many points
  std::optional<Outcome> Poll(const DaemonConfig& config, const std::function<void()>& step);

 private:
  using Clock = std::chrono::steady_clock;
  DiagnosisRun(DiagnosisProcess process, int applied_model, std::int64_t alarm_row,
               std::vector<JournalRow> rows)
      : process_(std::move(process)),
        applied_model_(applied_model),
        alarm_row_(alarm_row),
        rows_(std::move(rows)) {}
  Result<Outcome> Take(const DaemonConfig& config, const std::function<void()>& step) const;

  DiagnosisProcess process_;
  Clock::time_point began_ = Clock::now();
  int applied_model_;
  std::int64_t alarm_row_;
  std::vector<JournalRow> rows_;
};

/// Why a model must wait for a person although loop.apply is "automatic"; empty: it need not.
/// @param has_points  the configuration names points, so that their move counts, too
std::string WhyNotAutomatic(const ModelFacts& facts, const LoopConfig& loop, bool has_points);

}  // namespace plumbline
