#include "app/cell/daemon/reload.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <stop_token>
#include <string>

#include "app/base/log/log.h"
#include "app/base/service/utc_clock.h"
#include "app/cell/daemon/camera_supervisors.h"
#include "app/cell/daemon/cycle_setup.h"
#include "app/cell/daemon/model_in_force.h"
#include "app/cell/daemon/thread_watchdog.h"
#include "app/cell/model_store/cell_difference.h"
#include "app/cell/model_store/point_moves.h"

namespace plumbline::cell {
namespace {

// Refusal of a reloaded model that would move points farther than its data explain.

enum class ModelDecision {
  kAccepted,
  kWithdrawn,  ///< refused, and withdrawn in the store, which has the model in force again
  kRefused,    ///< refused, but the store was not changed
  kStopped,    ///< not decided
};

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

/// Decides whether the model of a reloaded configuration may come into force: not if there are
/// Objections to what it changes of the points, and no person has confirmed it. A
/// refusal is logged (kModelRefused) and withdrawn in the store, so that the model in force remains
/// applied after a restart. May take seconds, but not more than tens of milliseconds after a stop
/// is requested.
/// @param fresh     as read at the reload
/// @param running   the versions in force
/// @param in_force  the cell in force
/// @param carried   the present payload, if it is known
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

constexpr double kMaxPostponed_s = 10;

/// Logs what differs from the start, but takes effect at a restart only.
void LogNeededRestarts(const ConfigInForce& fresh_in_force, const config::DaemonConfig& started) {
  const config::DaemonConfig& fresh = fresh_in_force.config;
  if (PlcServersDiffer(fresh.plc, started.plc)) {
    log::Log(
        {log::Event::kNeedsRestart,
         "needs a restart: plc.listen, port, unit_id, max_clients, allow or [plc.rtu] differs from "
         "what the daemon started with"});
  }
  if (CamerasDiffer(fresh, started)) {
    log::Log(
        {log::Event::kNeedsRestart,
         "needs a restart: [camera], [zoom], [board], [tags] or the tags' file differs from what "
         "the daemon started with"});
  }
  if (fresh_in_force.configured_state_directory != started.state_directory) {
    log::Log({log::Event::kNeedsRestart,
              fmt::format("needs a restart: state_directory changed, {} stays in use",
                          started.state_directory)});
  }
}

/// Logs the faults that are not in `logged`.
void LogFurtherFaults(const config::FaultList& faults, const config::FaultList& logged) {
  config::FaultList further;
  for (const config::Fault& fault : faults.All()) {
    const auto same = [text = config::FaultText(fault)](const config::Fault& other) {
      return config::FaultText(other) == text;
    };
    if (std::none_of(logged.All().begin(), logged.All().end(), same)) further.Add(fault);
  }
  log::LogFaults(further);
}

}  // namespace

std::vector<Reporter::PointName> PointNames(const config::DaemonConfig& config) {
  std::vector<Reporter::PointName> names;
  for (const correction::AssemblyPoint& point : config.machine.points)
    names.push_back({point.id, point.name});
  return names;
}

void LogModel(const ConfigInForce& in_force) {
  const ModelState& models = in_force.models;
  log::SetLogContext({in_force.config.machine.cell.robot.name, models.applied});
  if (!in_force.set_aside.empty()) log::Log({log::Event::kModelSetAside, in_force.set_aside});
  if (models.applied == models.declared) return;
  log::Log({log::Event::kModelInForce,
            fmt::format("model version {} in force in place of the cell file", models.applied)});
}

void Reloader::Request() {
  running_.manager.Reloading();
  if (!pending()) pending_since_s_ = MonotonicSeconds();
  reread_ = reading_.valid() || WaitedForTooLong();
  if (!reread_) StartReading();
}

bool Reloader::WaitedForTooLong() const {
  return pending_ && MonotonicSeconds() - pending_since_s_ > kMaxPostponed_s;
}

void Reloader::Poll() {
  if (reading_.valid()) FinishReading();
  if (!pending_ || !pending_->parts->branches.finished()) return;
  PutInForce(std::move(*pending_));
  pending_.reset();
  Finish();
}

void Reloader::StartReading() {
  reread_ = false;
  pending_.reset();
  std::optional<loads::Payload> carried;
  if (const auto now = running_.cycle.ReadSnapshot(); now->payload_valid) carried = now->payload;
  reading_ = RunOnThread<std::optional<PendingReload>>([this, carried] { return Read(carried); });
}

void Reloader::FinishReading() {
  if (reading_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return;
  Result<std::optional<PendingReload>> read = reading_.get();
  if (!read) {
    log::Log({log::Event::kNotReloaded,
              fmt::format("Configuration not reloaded: {}. The previous one stays in force. Check "
                          "the machine's free memory and the limit of threads, then reload.",
                          read.error())});
    return Finish();
  }
  pending_ = std::move(read).value();
  if (!pending_) return Finish();
  if (reread_ && !WaitedForTooLong()) StartReading();
}

/// Answers the service manager, unless the files are to be read again.
void Reloader::Finish() {
  if (!reread_) return running_.manager.Ready("configuration reloaded");
  pending_since_s_ = MonotonicSeconds();
  StartReading();
}

std::optional<Reloader::PendingReload> Reloader::Read(
    const std::optional<loads::Payload>& carried) const {
  const std::string& file = running_.file;
  config::FaultList faults;
  std::optional<ConfigInForce> in_force = ReadConfigInForce(file, faults, running_.state);
  const std::size_t served = running_.cycle.parts().machine.config().points.size();
  if (in_force && served > 0 && in_force->config.machine.points.empty()) {
    faults.Add({.file = file,
                .key = "point",
                .what = fmt::format("the file has no [[point]], but {} points are in force: it may "
                                    "be truncated. Restore it, or restart the daemon to run "
                                    "without points",
                                    served)});
    in_force.reset();
  }
  log::LogFaults(faults);
  if (in_force) in_force = WithAcceptedModel(std::move(*in_force), faults, carried);
  if (stop_.stop_requested()) return std::nullopt;
  // The cameras are those of the start until a restart, and so is what requires them.
  if (in_force) {
    in_force->config.machine.required_lenses = running_.started.machine.required_lenses;
  }
  std::unique_ptr<CycleParts> parts =
      in_force ? PartsFrom(*in_force, &running_.cycle.parts()) : nullptr;
  if (!parts) {
    log::Log({log::Event::kNotReloaded,
              "Configuration not reloaded; the previous one stays in force. Fix the faults "
              "reported above, then reload."});
    return std::nullopt;
  }
  return PendingReload{std::move(*in_force), std::move(parts)};
}

std::optional<ConfigInForce> Reloader::WithAcceptedModel(
    ConfigInForce in_force, const config::FaultList& logged,
    const std::optional<loads::Payload>& carried) const {
  const auto decide = [&](const ConfigInForce& fresh) {
    return DecideOnModel(fresh, running_.state, running_.cycle.parts().machine.config().cell,
                         carried, stop_.get_token());
  };
  const ModelDecision decision = decide(in_force);
  if (decision == ModelDecision::kAccepted) return in_force;
  if (decision != ModelDecision::kWithdrawn || stop_.stop_requested()) return std::nullopt;
  config::FaultList faults;
  std::optional<ConfigInForce> again = ReadConfigInForce(running_.file, faults, running_.state);
  LogFurtherFaults(faults, logged);
  if (!again || decide(*again) != ModelDecision::kAccepted) return std::nullopt;
  return again;
}

void Reloader::PutInForce(PendingReload reload) {
  const config::DaemonConfig& fresh = reload.in_force.config;
  const ModelState& models = reload.in_force.models;
  LogNeededRestarts(reload.in_force, running_.started);
  const bool other_gauges = GaugesDiffer(fresh, running_.gauges.config());
  if (other_gauges) running_.gauges.Stop();  // its artefact numbers are those of the old cell
  running_.worker.Configure(fresh, models);  // before the new machine's first probe arrives
  const bool link_kept = reload.parts->link == running_.cycle.parts().link;
  reload.parts->branches.DeliverTo(reload.parts->machine, fresh.machine.points.size());
  ReplaceParts(std::move(reload.parts));
  if (other_gauges) running_.gauges.Start(fresh);
  running_.display.Configure(reload.in_force);
  running_.controller.Configure(fresh);
  running_.state.models = models;
  running_.robot_timeout_s = RobotTimeout_s(fresh);
  running_.watchdog.SetTimeout(kRobotLink, running_.robot_timeout_s);
  reporter_.Configure(PointNames(fresh), link_kept);
  reporter_.SetCell(fresh.machine.cell);
  log::Log({log::Event::kReloaded, fmt::format("configuration {} reloaded", running_.file)});
  LogModel(reload.in_force);
}

void Reloader::ReplaceParts(std::unique_ptr<CycleParts> parts) {
  // First the offset of a running motion returns to 0. Then the old link, which may have a reading
  // in progress, withdraws the points it has pushed.
  const double start_s = MonotonicSeconds();
  const auto& motion = running_.cycle.parts().motion;
  const bool motion_stops = motion && motion != parts->motion;
  const double longest_s = (motion_stops ? motion_link::MotionLink::kLongestStop_s : 0) +
                           running_.robot_timeout_s + robot::kWithdrawal_s;
  double fed_s = start_s;
  running_.cycle.Replace(std::move(parts), [&] {
    running_.plc.DepositConnections(running_.manager);
    const double now_s = MonotonicSeconds();
    const auto period_s = running_.manager.watchdog_period_s();
    if (!period_s || now_s - fed_s < *period_s) return;
    if (now_s - start_s > longest_s) return;
    fed_s = now_s;
    running_.manager.NotifyWatchdog();
  });
}

}  // namespace plumbline::cell
