#include "app/config/daemon_config_reader.h"

#include <arpa/inet.h>
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <set>

#include "app/config/arm_size.h"
#include "app/config/cell_reader.h"
#include "app/config/daemon_settings.h"
#include "app/config/file_kind.h"
#include "app/config/gauge_reader.h"
#include "app/config/limits.h"
#include "app/config/point_reader.h"
#include "app/config/posture_check.h"
#include "app/config/required_file.h"
#include "app/config/robot_profile_reader.h"
#include "app/config/text_file.h"
#include "drivers/files/package_paths.h"
#include "firmware-like/deflection/loaded_arm.h"
#include "firmware-like/loads/numbered_load.h"

namespace plumbline::config {
namespace {

bool IsAddress(const std::string& text) {
  in6_addr address;
  return inet_pton(AF_INET, text.c_str(), &address) == 1 ||
         inet_pton(AF_INET6, text.c_str(), &address) == 1;
}

/// True for a host name or an IP address; a text of digits and dots must be an address.
bool IsHost(const std::string& text) {
  constexpr std::string_view kNameCharacters =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789.-_";
  if (IsAddress(text)) return true;
  return text.size() <= 253 && text.find_first_not_of("0123456789.") != std::string::npos &&
         text.find_first_not_of(kNameCharacters) == std::string::npos;
}

/// @tparam Line  SerialLine or modbus::RtuSlaveOptions
template <typename Line>
void CheckSerial(const TomlTable& table, const Line& line) {
  if (!line.device.empty() && line.device.front() != '/') {
    table.AddFault("device", "is not an absolute path such as /dev/ttyUSB0");
  }
  constexpr int kRates[] = {1200,  2400,   4800,   9600,   19200, 38400,
                            57600, 115200, 230400, 460800, 921600};
  if (std::find(std::begin(kRates), std::end(kRates), line.baud) == std::end(kRates)) {
    table.AddFault("baud", "is not a standard baud rate (9600, 19200, 38400, 57600, 115200, ...)");
  }
}

RobotLinkConfig RobotLinkFromToml(const TomlTable& table, const NamedFiles& files,
                                  FaultList& faults) {
  RobotLinkConfig robot;
  robot::RobotConnection& connection = robot.connection;
  if (const auto file = files.Read(table, "profile", "profiles")) {
    if (auto profile = RobotProfileFromText(file->second, file->first, faults)) {
      connection.profile = std::move(*profile);
      connection.tcp.port = connection.profile.port;
      connection.unit_id = connection.profile.unit_id;
    }
  }
  ReadKeys(table, robot);
  const std::string& host = connection.tcp.host;
  if (!host.empty() && !IsHost(host)) table.AddFault("host", "is not a host name or IP address");
  const bool rtu = robot.transport == "rtu";
  if (connection.unit_id > 247 && (rtu || connection.unit_id != 255)) {
    table.AddFault("unit_id",
                   rtu ? "is outside 0..247, the ids of a serial line" : "is not 0..247 or 255");
  }
  CheckSerial(table, connection.serial);
  if (const auto file = files.ReadIf(robot.transport == "replay", table, "replay_file", "")) {
    robot.replay_file = file->first;
  }
  return robot;
}

PayloadPolicy PayloadFromToml(const TomlTable& table) {
  using Source = PayloadPolicy::Source;
  PayloadPolicy payload;
  ReadKeys(table, payload);
  std::set<int> numbers;
  for (const TomlTable& tool : table.Tables("tool")) {
    PayloadPolicy::ToolLoad load;
    load.number = -1;
    ReadKeys(tool, load);
    if (load.number >= 0 && !numbers.insert(load.number).second) {
      tool.AddFault("number", "is used for two tools");
    }
    payload.table.push_back(load);
  }
  if (payload.source == Source::kTable && !table.Has("tool")) {
    table.AddMissing("tool", "one [[payload.tool]] per tool number, since source is \"table\"");
  }
  return payload;
}

PlcConfig PlcFromToml(const TomlTable& table) {
  PlcConfig plc;
  modbus::TcpServerOptions& tcp = plc.tcp;
  ReadKeys(table, plc);
  if (!IsAddress(tcp.address)) {
    table.AddFault("listen",
                   "is not an IP address; write one such as 192.168.0.10, or 0.0.0.0 for all "
                   "networks");
  }
  for (const std::string& address : tcp.allow) {
    if (!IsAddress(address)) {
      table.AddFault("allow", fmt::format("contains \"{}\", which is not an IP address", address));
    }
  }
  if (const auto rtu = table.Table("rtu")) {
    ReadKeys(*rtu, plc.rtu.emplace());
    CheckSerial(*rtu, *plc.rtu);
    plc.rtu->unit_id = tcp.unit_id;
  }
  return plc;
}

void PushFromToml(const TomlTable& table, DaemonConfig& config) {
  robot::PushLimits& push = config.robot.connection.push;
  Settings keys(table);
  ListKeys(keys, push, config.push_ids);
  const std::vector<correction::AssemblyPoint>& points = config.machine.points;
  std::set<int> seen;
  for (const int id : config.push_ids) {
    const bool known =
        std::any_of(points.begin(), points.end(),
                    [id](const correction::AssemblyPoint& point) { return point.id == id; });
    if (!known)
      table.AddFault("point_ids",
                     fmt::format("contains {}, which is not the id of any [[point]]", id));
    if (!seen.insert(id).second) table.AddFault("point_ids", fmt::format("contains {} twice", id));
  }
  if (push.enabled && config.push_ids.empty() && !table.Has("point_ids")) {
    table.AddMissing("point_ids", "the ids of the points to push");
  }
}

/// Adds a fault if the cell has several tools or payload items, and the controller does not report
/// which of them is in use.
void RequireNumbers(const model::CellModel& cell, const robot::RobotProfile& profile,
                    const TomlTable& root) {
  const auto robot = root.Table("robot");
  if (!robot) return;
  if (cell.tools() > 1 && !profile.tool_number) {
    robot->AddFault("profile",
                    fmt::format("reads no tool number, but the cell declares {} [[tool]]; add "
                                "[tool_number] to it, or leave one tool in the cell",
                                cell.tools()));
  }
  if (!cell.payload_items.empty() && !profile.payload_item) {
    robot->AddFault("profile", fmt::format("reads no payload item, but the cell declares {} "
                                           "[[payload.item]]; add [payload_item] to it, or remove "
                                           "the items from the cell",
                                           cell.payload_items.size()));
  }
}

/// Adds a fault for each payload by tool number whose tool the cell does not declare.
void CheckPayloadTable(const model::CellModel& cell, const PayloadPolicy& policy,
                       const TomlTable& root) {
  const auto payload = root.Table("payload");
  if (!payload || policy.source != PayloadPolicy::Source::kTable || !cell.tool.number) return;
  const std::vector<TomlTable> tools = payload->Tables("tool");
  for (std::size_t k = 0; k < std::min(tools.size(), policy.table.size()); ++k) {
    const int number = policy.table[k].number;
    if (number < 0 || loads::ToolIndexOf(cell, number)) continue;
    tools[k].AddFault("number",
                      fmt::format("{} is not the number of a [[tool]] of the cell: no point is "
                                  "corrected with it; declare that tool, or remove this entry",
                                  number));
  }
}

/// Checks that the profile provides everything that the configuration needs from it.
void CheckAgainstProfile(const TomlTable& root, const DaemonConfig& config, bool cell_known) {
  using Source = PayloadPolicy::Source;
  const robot::RobotProfile& profile = config.robot.connection.profile;
  const int cell_joints = config.machine.cell.robot.size();
  const bool push_enabled = config.robot.connection.push.enabled;
  const auto robot = root.Table("robot");
  const auto payload = root.Table("payload");
  const auto push = root.Table("push");
  const auto joints = static_cast<int>(profile.joints.size());
  if (cell_known && robot && joints != cell_joints) {
    robot->AddFault("profile", fmt::format("has {} joints; the cell has {}", joints, cell_joints));
  }
  if (config.robot.transport == "replay") {
    if (push_enabled && push)
      push->AddFault("enabled", "is not possible with transport \"replay\"");
    return;
  }
  if (config.machine.payload.source == Source::kRobot && !profile.payload_mass) {
    const std::string what = fmt::format(
        "the profile {} reads no payload mass; use \"table\" or \"fixed\"", profile.name);
    if (payload) payload->AddFault("source", "cannot be used: " + what);
    if (!payload) root.AddWarning("payload", "missing, and " + what);
  }
  if (config.machine.payload.source == Source::kTable && !profile.tool_number && payload) {
    payload->AddFault(
        "source",
        fmt::format("requires a tool number, which the profile {} does not read", profile.name));
  }
  RequireNumbers(config.machine.cell, profile, root);
  CheckPayloadTable(config.machine.cell, config.machine.payload, root);
  if (!push || !push_enabled) return;
  const int slots = profile.push ? profile.push->slots : 0;
  if (slots == 0) {
    push->AddFault("enabled",
                   fmt::format("requires a [push] table in the profile {}", profile.name));
  } else if (static_cast<int>(config.push_ids.size()) > slots) {
    push->AddFault("point_ids", fmt::format("has {} ids; the profile {} has {} slots",
                                            config.push_ids.size(), profile.name, slots));
  }
}

/// PLC server and page cannot share a port.
void CheckPorts(const TomlTable& page, const DaemonConfig& config) {
  const std::string &plc = config.plc.tcp.address, &own = config.page.listen;
  if (config.page.port.value_or(0) == 0 || *config.page.port != config.plc.tcp.port) return;
  if (plc != own && !IsWildcardAddress(plc) && !IsWildcardAddress(own)) return;
  page.AddFault("port",
                fmt::format("is the same as [plc] port, and the addresses {} and {} overlap; give "
                            "the page another port",
                            plc, own));
}

/// [monitoring], or [loop], its previous name, which is read for one version.
std::optional<TomlTable> MonitoringTable(const TomlTable& root) {
  if (!root.Has("loop")) return root.Table("monitoring");
  if (root.Has("monitoring")) {
    root.AddFault("loop",
                  "is the previous name of [monitoring], which is given too; keep only "
                  "[monitoring]");
    root.Ignore({"loop"});
    return root.Table("monitoring");
  }
  root.AddWarning("loop",
                  "is now called [monitoring]; rename it, the next version will not read [loop]");
  return root.Table("loop");
}

/// A gauge whose readings cannot be recorded, or whose line belongs to another device.
void CheckGauges(const TomlTable& root, const DaemonConfig& config) {
  if (config.gauges.empty()) return;
  if (!config.monitoring.enabled) {
    root.AddWarning("gauge",
                    "readings of gauges are not recorded: set enabled = true in [monitoring]");
  }
  for (const GaugeConfig& gauge : config.gauges) {
    if (gauge.connection.kind != gauge::GaugeKind::kSerial) continue;
    const std::string& device = gauge.connection.device;
    const bool of_robot =
        config.robot.transport == "rtu" && device == config.robot.connection.serial.device;
    const bool of_plc = config.plc.rtu && device == config.plc.rtu->device;
    if (of_robot || of_plc) {
      root.AddFault("gauge", fmt::format("uses {}, which is the line of {}", device,
                                         of_robot ? "[robot]" : "[plc.rtu]"));
    }
  }
}

}  // namespace

std::optional<DaemonConfig> DaemonConfigFromText(std::string_view text, const std::string& file,
                                                 const FileSource& files,
                                                 const std::string& data_directory,
                                                 FaultList& faults, std::size_t postures) {
  FaultList own;
  FaultList of_others;
  TomlDocument document(text, file, own);
  DaemonConfig config;
  config.file = file;
  const auto kind = FileKindOf(text);
  if (kind == FileKind::kProfile) {
    own.Add({Fault::Severity::kFault, file, 0, "",
             "is a robot profile or a lens profile, not the daemon's configuration; give the "
             "plumbline.toml that refers to it"});
  } else if (kind == FileKind::kCell) {
    own.Add({Fault::Severity::kFault, file, 0, "",
             "is a cell, not the daemon's configuration; give the plumbline.toml that refers to it "
             "by cell = \"...\""});
  } else if (document.parsed()) {
    const TomlTable root = document.Root();
    const NamedFiles named(file, files, data_directory);
    bool cell_known = false;
    std::string cell_text;
    if (const auto cell_file = named.Read(root, "cell", "cells")) {
      config.cell_file = cell_file->first;
      if (auto cell = CellFromText(cell_file->second, cell_file->first, of_others)) {
        config.machine.cell = deflection::CellOfSession(*cell, "");
        cell_known = true;
        cell_text = cell_file->second;
      }
    }
    const auto robot = root.RequiredTable("robot");
    const double& stale_after_s = config.machine.plausibility.stale_after_s;
    if (robot) {
      config.robot = RobotLinkFromToml(*robot, named, of_others);
      ReadKeys(*robot, config.machine.plausibility);
    }
    if (const auto table = root.Table("payload")) config.machine.payload = PayloadFromToml(*table);
    if (const auto table = root.Table("plc")) config.plc = PlcFromToml(*table);
    if (const auto table = root.Table("correction")) ReadKeys(*table, config.machine.limits);
    if (const auto table = root.Table("cycle")) {
      Settings keys(*table);
      ListCycleKeys(keys, config.cycle_period_s);
    }
    ReadKeys(root, config, &named);
    config.machine.points = PointsFromToml(root, cell_known ? &config.machine.cell : nullptr);
    if (cell_known) WarnAboutHeavyPayloads(root, config.machine);
    config.gauges = GaugesFromToml(root, cell_known ? &config.machine.cell : nullptr);
    if (const auto table = root.Table("push")) PushFromToml(*table, config);
    if (const auto table = MonitoringTable(root)) config.monitoring = MonitoringFromToml(*table);
    CheckGauges(root, config);
    config.vision = VisionFromToml(root, named, of_others);
    const std::size_t cameras = std::min(config.vision.cameras.size(), model::kMaxCameras);
    for (std::size_t k = 0; k < cameras; ++k) {
      config.machine.required_lenses[k] = config.vision.cameras[k].RequiredForPoints();
    }
    if (const auto table = root.Table("overlay")) {
      config.overlay = OverlayFromToml(*table, named, config.vision);
    }
    if (const auto table = root.Table("page")) {
      config.page = PageFromToml(*table);
      CheckPorts(*table, config);
    }
    if (const auto table = root.Table("mqtt")) {
      config.mqtt = MqttFromToml(*table, named, config.machine.cell.robot.name);
    }
    if (robot && stale_after_s < config.cycle_period_s) {
      robot->AddFault("stale_after_ms",
                      fmt::format("is less than the cycle time of {:g} ms: robot data would always "
                                  "be stale",
                                  config.cycle_period_s / kSecondPerMs));
    }
    if (!config.robot.connection.profile.joints.empty())
      CheckAgainstProfile(root, config, cell_known);
    document.ReportUnknownKeys();
    if (cell_known && !own.HasFaults() && !of_others.HasFaults()) {
      // The cell is parsed again so that warnings about its base have a file and line.
      TomlDocument cell(cell_text, config.cell_file, of_others);
      const bool own_base = config.machine.cell.sessions.empty();
      WarnAboutUnlikelyPostures(root, own_base ? cell.Root().Table("robot") : std::nullopt,
                                config.machine, postures);
    }
  }
  own.SortByLine();
  faults.Append(own);
  faults.Append(of_others);
  if (own.HasFaults() || of_others.HasFaults()) return std::nullopt;
  return config;
}

std::string InstalledDataDirectory() {
  std::error_code none;
  const auto beside =
      std::filesystem::path(files::ProgramFolder()).parent_path() / "share/plumbline";
  if (std::filesystem::is_directory(beside, none)) return beside.string();
  return PLUMBLINE_DATADIR;
}

std::optional<DaemonConfig> DaemonConfigFromText(std::string_view text, const std::string& file,
                                                 const FileSource& files, FaultList& faults,
                                                 std::size_t postures) {
  return DaemonConfigFromText(text, file, files, InstalledDataDirectory(), faults, postures);
}

std::optional<DaemonConfig> DaemonConfigFromText(std::string_view text, const std::string& file,
                                                 FaultList& faults, std::size_t postures) {
  return DaemonConfigFromText(text, file, ReadTextFile, InstalledDataDirectory(), faults, postures);
}

std::optional<DaemonConfig> ReadDaemonConfig(const std::string& path, FaultList& faults,
                                             std::size_t postures) {
  const auto text = ReadRequiredFile(path, faults);
  return text ? DaemonConfigFromText(*text, path, faults, postures) : std::nullopt;
}

}  // namespace plumbline::config
