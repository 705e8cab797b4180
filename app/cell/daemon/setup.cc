#include "app/cell/daemon/setup.h"

#include <fmt/format.h>

#include "app/base/log/fault_log.h"
#include "app/base/log/log.h"
#include "app/measure/table/replay_file.h"
#include "drivers/plc/command_registers.h"

namespace plumbline::cell {
namespace {

constexpr std::size_t kMaxReplayWarnings = 10;

Result<robot::ReplayRows> ReplayFrom(const config::DaemonConfig& config) {
  config::FaultList faults;
  const std::optional<measure::MeasuredTable> table = measure::ReadReplayFile(config, faults);
  std::size_t warnings = 0;
  for (const config::Fault& fault : faults.All()) {
    const bool warning = fault.severity == config::Fault::Severity::kWarning;
    if (warning && ++warnings > kMaxReplayWarnings) continue;
    log::LogFault(fault);
  }
  if (warnings > kMaxReplayWarnings) {
    log::Log({log::Event::kFileWarning,
              fmt::format("{} more warnings about {}", warnings - kMaxReplayWarnings,
                          config.robot.replay_file)});
  }
  if (!table) return Error{fmt::format("{} cannot be replayed", config.robot.replay_file)};
  robot::ReplayRows replay = config.robot.connection.replay;
  for (const measure::MeasuredRow& row : table->rows) {
    robot::ReplayRow& replayed = replay.rows.emplace_back();
    replayed.q = row.q;
    replayed.payload_kg = row.payload_kg;
    replayed.temp_C = row.temp_C;
    replayed.tool_number = row.tool_number;
    replayed.payload_item = row.payload_item;
  }
  return replay;
}

}  // namespace

Result<RobotSetup> RobotSetupFrom(const config::DaemonConfig& config) {
  RobotSetup robot{config.robot.transport, config.robot.connection, config.push_ids};
  if (robot.transport == "replay") {
    Result<robot::ReplayRows> replay = ReplayFrom(config);
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
  add(0, plc::registers::kStateSize);
  add(plc::registers::kResult, plc::registers::kResultSize);
  add(plc::registers::kScaled, plc::registers::kScaledSize);
  add(plc::registers::kInputs, plc::registers::kInputsSize);
  add(plc::registers::kMonitoring, plc::registers::kMonitoringSize);
  for (std::size_t k = 0; k < model::kMaxCameras; ++k) {
    add(plc::registers::kCamera + plc::registers::kCameraStride * k, plc::registers::kCameraSize);
    add(plc::registers::kBodies + plc::registers::kCameraStride * k,
        plc::registers::kBodySize * status::CameraStatus::kMaxBodies);
  }
  add(plc::registers::kScene, plc::registers::kSceneSize);
  add(plc::registers::kGauges, plc::registers::kGaugeSize * status::kMaxGauges);
  if (points > 0) {
    add(plc::registers::kPoints, plc::registers::kPointSize * points);
    add(plc::registers::kPostures, plc::registers::kPostureSize * points);
  }
  return std::make_shared<modbus::AddressRanges>(std::move(ranges));
}

modbus::CommandArea EmptyCommandArea() {
  modbus::CommandArea area;
  area.registers = {plc::registers::kCommands,
                    std::vector<std::uint16_t>(plc::registers::kCommandsSize)};
  area.coils = {plc::registers::kCoils, std::vector<std::uint8_t>(plc::registers::kCoilsSize)};
  constexpr std::uint16_t kHeartbeat = plc::CommandNamed("plc_heartbeat").address;
  area.non_command_registers = {kHeartbeat, kHeartbeat};
  return area;
}

}  // namespace plumbline::cell
