#include "app/cli/model_moves.h"

#include <fmt/format.h>

#include <ctime>
#include <filesystem>
#include <optional>

#include "app/base/config/daemon_config_reader.h"
#include "app/cell/model_store/configuration_note.h"
#include "app/cell/model_store/model_change.h"
#include "app/cell/model_store/point_moves.h"
#include "app/cli/reported_loads.h"

namespace plumbline::cli {
namespace {

/// Report for the case that the configured points are unknown.
ModelMoves UnloadedTip(const model::CellModel& in_force, const model::CellModel& next,
                       const std::string& why) {
  const auto change_m = cell::LargestTipChange(in_force, next, cell::PosesWithinLimits(in_force));
  return {
      fmt::format("{}{}. How far its points move under load is therefore unknown\n",
                  change_m
                      ? fmt::format("Without payload and within the joint limits, it moves the tip "
                                    "by up to {:.3f} mm compared with the model in force. ",
                                    1e3 * *change_m)
                      : "",
                  why),
      {}};
}

bool SameFolder(const std::string& a, const std::string& b) {
  std::error_code unknown;
  return std::filesystem::equivalent(a, b, unknown) && !unknown;
}

}  // namespace

Result<ModelMoves> MovesOfPoints(const std::string& state_directory, const std::string& config_file,
                                 const model::CellModel& in_force, const model::CellModel& next) {
  const bool given = !config_file.empty();
  const std::optional<std::string> file =
      given ? std::optional(config_file) : cell::RecordedConfigurationPath(state_directory);
  if (!file) {
    return UnloadedTip(in_force, next,
                       fmt::format("No daemon has recorded its configuration in {}; give it "
                                   "with --config",
                                   state_directory));
  }
  config::FaultList faults;
  const std::optional<config::DaemonConfig> config = config::ReadDaemonConfig(*file, faults);
  if (!config && given)
    return Error{fmt::format("{}{} cannot be used", config::FaultsText(faults), *file)};
  if (!config) {
    return UnloadedTip(in_force, next,
                       fmt::format("The daemon's configuration {} cannot be read or has "
                                   "faults (run `plumbline check {}`)",
                                   *file, *file));
  }
  if (!given && !SameFolder(config->state_directory, state_directory)) {
    return UnloadedTip(in_force, next,
                       fmt::format("{}, which a daemon recorded in {}, now uses the state "
                                   "directory {}; give the configuration with --config",
                                   *file, state_directory, config->state_directory));
  }
  if (config->machine.points.empty()) {
    return UnloadedTip(in_force, next, fmt::format("{} has no [[point]]", *file));
  }
  const cell::PointMoves moves = cell::ComputePointMoves(config->machine, in_force, next,
                                                         static_cast<double>(std::time(nullptr)),
                                                         LoadsReportedByRobot(*config));
  return ModelMoves{cell::TextOf(moves, *file) +
                        "note: poses that the PLC submits for correction by command are not "
                        "included\n",
                    cell::Objections(moves)};
}

}  // namespace plumbline::cli
