#include "app/cli/model_moves.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <ctime>
#include <filesystem>
#include <optional>
#include <string_view>
#include <vector>

#include "app/base/config/daemon_config.h"
#include "app/base/config/daemon_config_reader.h"
#include "app/cell/journal/journal.h"
#include "app/cell/model_store/configuration_note.h"
#include "app/cell/model_store/model_change.h"
#include "app/cell/model_store/point_moves.h"
#include "drivers/plc/codec.h"
#include "drivers/robot/modbus_client.h"
#include "firmware-like/geometry/units.h"

namespace plumbline::cli {
namespace {

// Payloads that the robot reports now or has reported (registers, journal), for payload source
// "robot".

constexpr double kReadTimeout_s = 0.3;
constexpr std::int64_t kMaxLoadRows = 12000;     // as many as a diagnosis uses
constexpr std::uint16_t kPayloadKnown = 1 << 2;  // bit of input_validity

/// The current payload according to the daemon's registers.
std::optional<cell::ReportedLoad> LoadOfDaemon(const config::PlcConfig& plc) {
  if (plc.tcp.port == 0) return std::nullopt;
  auto client = robot::ModbusClient::Tcp(
      {config::IsWildcardAddress(plc.tcp.address) ? "127.0.0.1" : plc.tcp.address, plc.tcp.port},
      plc.tcp.unit_id, kReadTimeout_s, MonotonicSeconds);
  if (!client || client.value().Connect() != robot::LinkResult::kOk) return std::nullopt;
  std::array<std::uint16_t, 3> head{};
  std::array<std::uint16_t, plc::registers::kInputsSize> inputs{};
  const auto read = [&client](int first, std::span<std::uint16_t> words) {
    return client.value().Read(
               {robot::RegisterTable::kHolding, first, static_cast<int>(words.size())}, words) ==
           robot::LinkResult::kOk;
  };
  if (!read(0, head) || head[0] != plc::registers::kMagic ||
      !read(plc::registers::kInputs, inputs)) {
    return std::nullopt;
  }
  const auto value = [&](std::string_view name) {
    for (const plc::MapField& field : plc::registers::Fields()) {
      if (name != field.name) continue;
      return plc::ValueOfField(field.type, inputs, field.address - plc::registers::kInputs,
                               head[2] == 1);
    }
    return 0.0;
  };
  if ((static_cast<int>(value("input_validity")) & kPayloadKnown) == 0) return std::nullopt;
  return cell::ReportedLoad{value("payload"),
                            kMetrePerMm * Vec3(value("cog_x"), value("cog_y"), value("cog_z"))};
}

/// The current payload, read from the registers of the daemon running on this computer, and the
/// smallest and largest payload in the newest rows of the journal. Sources that are not available
/// are skipped: no daemon, a port not given in the configuration, no journal. Takes at most a
/// second.
std::vector<cell::ReportedLoad> LoadsReportedByRobot(const config::DaemonConfig& config) {
  std::vector<cell::ReportedLoad> loads;
  if (config.machine.payload.source != PayloadPolicy::Source::kRobot) return loads;
  if (const auto now = LoadOfDaemon(config.plc)) loads.push_back(*now);

  const std::string file = config.state_directory + "/journal.sqlite";
  std::error_code hidden;
  if (!std::filesystem::exists(file, hidden)) return loads;
  auto journal = cell::Journal::OpenForReading(file);
  if (!journal) return loads;
  std::optional<double> least, most;
  cell::JournalFilter filter;
  filter.last = kMaxLoadRows;
  const auto read = journal.value().ForEach(
      filter, config.machine.cell.robot.joints, [&](const cell::JournalRow& row) {
        if (!row.payload_kg) return;
        least = std::min(least.value_or(*row.payload_kg), *row.payload_kg);
        most = std::max(most.value_or(*row.payload_kg), *row.payload_kg);
      });
  if (!read || !least) return loads;
  loads.push_back({*least, std::nullopt});
  loads.push_back({*most, std::nullopt});
  return loads;
}

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
