#include "app/cell/daemon/model_guard.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <string>

#include "app/base/log/log.h"
#include "app/base/service/utc_clock.h"
#include "app/cell/model_store/cell_difference.h"
#include "app/cell/model_store/point_moves.h"

namespace plumbline::cell {
namespace {

/// How long to wait for another process that writes the store, see model_in_force.cc.
constexpr double kWithdrawalTimeout_s = 1.5;

Result<void> Withdraw(const std::string& directory, int refused, int in_force) {
  Result<ModelStore> store = ModelStore::Open(directory);
  if (!store) return store.failure();
  store.value().SetLockTimeout(kWithdrawalTimeout_s);
  return store.value().Withdraw(refused, in_force);
}

/// What a person can do about a refused version: accept it, or correct its cause.
std::string Remedy(const ConfigInForce& fresh, const std::string& directory) {
  const int refused = fresh.models.applied;
  const std::string accept = ModelCommand(fmt::format("apply {} --force", refused), directory);
  if (refused == fresh.models.declared) {
    return fmt::format("Undo the edit of the cell file, or accept it with {}", accept);
  }
  return fmt::format(
      "Check version {} and the measurement that it was fitted to; {} puts it in force anyway",
      refused, accept);
}

/// A refusal, and what it means for a person: what stays in force and for how long, and the remedy.
struct Refusal {
  ModelDecision decision;
  std::string consequence;
};

Refusal Refuse(const ConfigInForce& fresh, const RunningDaemon& running) {
  const int refused = fresh.models.applied, in_force = running.models.applied;
  const std::string& directory = running.state_directory;
  if (refused == 0 || in_force == 0 || !running.owns_directory) {  // nothing to withdraw here
    return {ModelDecision::kRefused,
            "The previous model stays in force until a restart. Undo the change; to accept it, "
            "restart the daemon"};
  }
  const Result<void> withdrawn = Withdraw(directory, refused, in_force);
  const std::string remedy = Remedy(fresh, directory);
  if (withdrawn) {
    return {ModelDecision::kWithdrawn,
            fmt::format("Version {} stays in force, also after a restart. {}", in_force, remedy)};
  }
  return {
      ModelDecision::kRefused,
      fmt::format(
          "Version {} stays in force, but only until a restart, because version {} could not "
          "be withdrawn ({}); {} keeps version {} in force after a restart. {}",
          in_force, refused, withdrawn.error(),
          ModelCommand(fmt::format("apply {} --force", in_force), directory), in_force, remedy)};
}

}  // namespace

ModelDecision DecideOnModel(const ConfigInForce& fresh, const RunningDaemon& running,
                            const model::CellModel& in_force,
                            const std::optional<loads::Payload>& carried,
                            const std::stop_token& stop) {
  const MachineConfig& machine = fresh.config.machine;
  const int refused = fresh.models.applied;
  if (fresh.models.confirmed || CellDifferences(in_force, machine.cell).empty()) {
    return ModelDecision::kAccepted;
  }
  std::vector<ReportedLoad> loads;
  if (carried) loads.push_back({carried->mass_kg, carried->cog_F});
  const PointMoves moves = ComputePointMoves(machine, in_force, machine.cell,
                                             service::SystemUtcSeconds(), loads, {}, stop);
  if (stop.stop_requested()) return ModelDecision::kStopped;
  const std::vector<std::string> objections = Objections(moves);
  if (objections.empty()) return ModelDecision::kAccepted;
  const Refusal refusal = Refuse(fresh, running);
  log::Log({log::Event::kModelRefused,
            fmt::format(
                "{} is not put in force: {}. {}",
                refused == 0 ? "the changed cell file" : fmt::format("model version {}", refused),
                fmt::join(objections, "; "), refusal.consequence)});
  return refusal.decision;
}

}  // namespace plumbline::cell
