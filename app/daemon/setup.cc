#include "app/daemon/setup.h"

#include "app/table/csv.h"

namespace plumbline {
namespace {

Result<ReplayRows> ReplayFrom(const DaemonConfig& config) {
  FaultList faults;
  const std::optional<MeasuredTable> table =
      ReadTable(config.robot.replay_file, config.cell.robot.joints, faults);
  if (!table) return Error{FaultsText(faults)};
  ReplayRows replay;
  replay.loop = true;
  for (const MeasuredRow& row : table->rows) {
    ReplayRow& played = replay.rows.emplace_back();
    played.q = row.q;
    if (table->recorded.payload) played.payload_kg = row.payload_kg;
    if (table->recorded.temperature) played.temp_C = row.temp_C;
  }
  replay.rows_per_s = 1;  // recorded poses are stations, not a trajectory
  return replay;
}

}  // namespace

MachineConfig MachineConfigFrom(const DaemonConfig& config) {
  MachineConfig machine;
  machine.cell = config.cell;
  machine.points = config.points;
  machine.limits = {config.correction.max_translation_m, config.correction.max_rotation_rad,
                    config.correction.min_singular_value, config.correction.deflection_sd};
  machine.plausibility.stale_after_s = config.robot.stale_after_s;
  switch (config.payload.source) {
    case PayloadConfig::Source::kRobot:
      machine.payload.source = PayloadPolicy::Source::kRobot;
      break;
    case PayloadConfig::Source::kTable:
      machine.payload.source = PayloadPolicy::Source::kTable;
      break;
    case PayloadConfig::Source::kFixed:
      machine.payload.source = PayloadPolicy::Source::kFixed;
      break;
  }
  machine.payload.fixed = {0, config.payload.mass_kg, config.payload.cog_F};
  for (const ToolLoad& load : config.payload.table) {
    machine.payload.table.push_back({load.number, load.mass_kg, load.cog_F});
  }
  return machine;
}

PlcConvention PlcConventionFrom(const PlcConfig& config) {
  return {config.little_word_first, config.orientation};
}

Result<std::unique_ptr<RobotDevice>> RobotFrom(const DaemonConfig& config) {
  const RobotLinkConfig& link = config.robot;
  RobotConnection connection;
  connection.tcp = {link.host, link.port};
  connection.serial = {link.serial.device, link.serial.baud, link.serial.parity,
                       link.serial.stop_bits};
  connection.unit_id = link.unit_id;
  connection.timeout_s = link.timeout_s;
  connection.profile = link.profile;
  connection.push = {config.push.enabled, config.push.max_step_m, config.push.min_period_s};
  switch (link.transport) {
    case RobotLinkConfig::Transport::kTcp:
      return MakeRobot("tcp", connection);
    case RobotLinkConfig::Transport::kRtu:
      return MakeRobot("rtu", connection);
    case RobotLinkConfig::Transport::kReplay: {
      Result<ReplayRows> replay = ReplayFrom(config);
      if (!replay) return Error{replay.error()};
      connection.replay = std::move(replay).value();
      return MakeRobot("replay", connection);
    }
  }
  return Error{"no such transport"};
}

modbus::TcpServerOptions TcpServerOptionsFrom(const PlcConfig& config) {
  modbus::TcpServerOptions options;
  options.address = config.listen;
  options.port = config.port;
  options.unit_id = static_cast<std::uint8_t>(config.unit_id);
  options.max_clients = config.max_clients;
  options.allow = config.allow;
  return options;
}

modbus::RtuSlaveOptions RtuSlaveOptionsFrom(const PlcConfig& config) {
  modbus::RtuSlaveOptions options;
  options.device = config.rtu->device;
  options.baud = config.rtu->baud;
  options.parity = config.rtu->parity;
  options.stop_bits = config.rtu->stop_bits;
  options.unit_id = static_cast<std::uint8_t>(config.unit_id);
  return options;
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
  if (points > 0) add(plc_map::kPoints, plc_map::kPointSize * points);
  return std::make_shared<modbus::AddressRanges>(std::move(ranges));
}

modbus::CommandArea EmptyCommandArea() {
  modbus::CommandArea area;
  area.registers = {plc_map::kCommands, std::vector<std::uint16_t>(plc_map::kCommandsSize)};
  area.coils = {plc_map::kCoils, std::vector<std::uint8_t>(plc_map::kCoilsSize)};
  return area;
}

}  // namespace plumbline
