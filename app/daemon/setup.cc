#include "app/daemon/setup.h"

#include <fmt/format.h>

#include "app/log/fault_log.h"
#include "app/log/log.h"
#include "app/table/measured_point_from_row.h"
#include "app/table/replay_file.h"
#include "drivers/plc/command_registers.h"

namespace plumbline {
namespace {

constexpr std::size_t kMaxReplayWarnings = 10;

Result<ReplayRows> ReplayFrom(const DaemonConfig& config) {
  FaultList faults;
  const std::optional<MeasuredTable> table = ReadReplayFile(config, faults);
  std::size_t warnings = 0;
  for (const Fault& fault : faults.All()) {
    const bool warning = fault.severity == Fault::Severity::kWarning;
    if (warning && ++warnings > kMaxReplayWarnings) continue;
    LogFault(fault);
  }
  if (warnings > kMaxReplayWarnings) {
    Log({Event::kFileWarning,
         fmt::format("{} more warnings about {}", warnings - kMaxReplayWarnings,
                     config.robot.replay_file)});
  }
  if (!table) return Error{fmt::format("{} cannot be replayed", config.robot.replay_file)};
  ReplayRows replay = config.robot.connection.replay;
  for (const MeasuredRow& row : table->rows) {
    ReplayRow& replayed = replay.rows.emplace_back();
    const MeasuredPoint point = MeasuredPointFromRow(row, table->recorded);
    replayed.q = point.q;
    replayed.payload_kg = point.payload_kg;
    replayed.temp_C = point.temp_C;
  }
  return replay;
}

}  // namespace

Result<RobotSetup> RobotSetupFrom(const DaemonConfig& config) {
  RobotSetup robot{config.robot.transport, config.robot.connection, config.push_ids};
  if (robot.transport == "replay") {
    Result<ReplayRows> replay = ReplayFrom(config);
    if (!replay) return Error{replay.error()};
    robot.connection.replay = std::move(replay).value();
  }
  return robot;
}

std::shared_ptr<const modbus::AddressRanges> ReadableRanges(std::size_t points) {
  std::vector<modbus::AddressRanges::Range> ranges;
  // Registers between two entries of a window read as 0: a PLC reads a window in one request.
  const auto add = [&ranges](std::size_t first, std::size_t size) {
    ranges.push_back(
        {static_cast<std::uint16_t>(first), static_cast<std::uint16_t>(first + size - 1)});
  };
  add(0, plc_map::kStateSize);
  add(plc_map::kResult, plc_map::kResultSize);
  add(plc_map::kScaled, plc_map::kScaledSize);
  add(plc_map::kInputs, plc_map::kInputsSize);
  add(plc_map::kMonitoring, plc_map::kMonitoringSize);
  for (std::size_t k = 0; k < kMaxCameras; ++k) {
    add(plc_map::kCamera + plc_map::kCameraStride * k, plc_map::kCameraSize);
    add(plc_map::kBodies + plc_map::kCameraStride * k,
        plc_map::kBodySize * CameraStatus::kMaxBodies);
  }
  add(plc_map::kScene, plc_map::kSceneSize);
  if (points > 0) {
    add(plc_map::kPoints, plc_map::kPointSize * points);
    add(plc_map::kPostures, plc_map::kPostureSize * points);
  }
  return std::make_shared<modbus::AddressRanges>(std::move(ranges));
}

modbus::CommandArea EmptyCommandArea() {
  modbus::CommandArea area;
  area.registers = {plc_map::kCommands, std::vector<std::uint16_t>(plc_map::kCommandsSize)};
  area.coils = {plc_map::kCoils, std::vector<std::uint8_t>(plc_map::kCoilsSize)};
  constexpr std::uint16_t kHeartbeat = CommandNamed("plc_heartbeat").address;
  area.non_command_registers = {kHeartbeat, kHeartbeat};
  return area;
}

}  // namespace plumbline
