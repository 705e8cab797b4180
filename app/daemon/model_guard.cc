#include "app/daemon/model_guard.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <string>

#include "app/log/log.h"
#include "app/model_store/cell_difference.h"
#include "app/model_store/point_moves.h"
#include "app/service/utc_clock.h"

namespace plumbline::daemon {
namespace {

/// How long to wait for another process that writes the store, see model_in_force.cc.
constexpr double kWithdrawalTimeout_s = 1.5;

Result<void> Withdraw(const std::string& directory, int refused, int in_force) {
  Result<model_store::ModelStore> store = model_store::ModelStore::Open(directory);
  if (!store) return store.failure();
  store.value().SetLockTimeout(kWithdrawalTimeout_s);
  return store.value().Withdraw(refused, in_force);
}

/// What stays in force and for how long, and how a person decides otherwise.
std::string Consequence(const RunningDaemon& running, int refused) {
  const int in_force = running.models.applied;
  if (refused == 0 || in_force == 0 || !running.owns_directory) {  // nothing to withdraw here
    return "The previous model stays in force until a restart. Undo the change; to accept it, "
           "restart the daemon";
  }
  const Result<void> withdrawn = Withdraw(running.state_directory, refused, in_force);
  const std::string how_long =
      withdrawn ? "also after a restart"
                : fmt::format("but only until a restart ({}), so withdraw version {} with {}",
                              withdrawn.error(), refused,
                              model_store::ModelCommand(fmt::format("apply {}", in_force),
                                                        running.state_directory));
  return fmt::format(
      "Version {} stays in force, {}. Check version {} and the measurement that it was fitted to; "
      "{} puts it in force anyway",
      in_force, how_long, refused,
      model_store::ModelCommand(fmt::format("apply {} --force", refused), running.state_directory));
}

}  // namespace

bool RefusesModel(const ConfigInForce& fresh, const RunningDaemon& running,
                  const model::CellModel& in_force, const std::optional<loads::Payload>& carried) {
  const MachineConfig& machine = fresh.config.machine;
  const int refused = fresh.models.applied;
  if (fresh.models.confirmed || model_store::CellDifferences(in_force, machine.cell).empty()) {
    return false;
  }
  std::vector<model_store::ReportedLoad> loads;
  if (carried) loads.push_back({carried->mass_kg, carried->cog_F});
  const std::vector<std::string> objections =
      model_store::Objections(model_store::ComputePointMoves(machine, in_force, machine.cell,
                                                             service::SystemUtcSeconds(), loads));
  if (objections.empty()) return false;
  log::Log({log::Event::kModelRefused,
            fmt::format(
                "{} is not put in force: {}. {}",
                refused == 0 ? "the changed cell file" : fmt::format("model version {}", refused),
                fmt::join(objections, "; "), Consequence(running, refused))});
  return true;
}

}  // namespace plumbline::daemon
