#include "app/base/config/daemon_config_reader.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "app/base/config/arm_size.h"
#include "app/base/config/cell_reader.h"
#include "app/base/config/daemon_config_checks.h"
#include "app/base/config/daemon_settings.h"
#include "app/base/config/posture_check.h"
#include "app/base/config/required_file.h"
#include "app/base/config/robot_profile_reader.h"
#include "app/base/config/secret_file.h"
#include "app/base/config/settings_text.h"
#include "app/base/config/toml_reader.h"
#include "app/base/config/unlikely_values.h"
#include "app/base/config/wrong_file.h"
#include "drivers/files/package_paths.h"
#include "drivers/files/text_file.h"
#include "drivers/plc/register_map.h"
#include "firmware-like/correction/assembly_point.h"
#include "firmware-like/deflection/loaded_arm.h"
#include "firmware-like/geometry/rotation.h"
#include "firmware-like/model/joint_columns.h"

namespace plumbline::config {
namespace {

// Reader of the [[frame]] and [[point]] tables of a configuration.

using FrameTable = std::map<std::string, Pose>;

Pose PoseOf(const FrameKeys& placed) {
  return {.R = RotationFromRollPitchYaw(placed.rpy_rad), .p = placed.xyz_m};
}

FrameTable FramesFromToml(const TomlTable& root, const model::CellModel* cell) {
  FrameTable frames;
  frames["measurement"] = Pose();
  frames["base"] = cell != nullptr ? cell->robot.X_WB : Pose();
  for (const TomlTable& table : root.Tables("frame")) {
    FrameKeys frame;
    ReadKeys(table, frame);
    if (!frame.name.empty() && !frames.emplace(frame.name, PoseOf(frame)).second) {
      table.AddFault("name", "is used for two frames (\"measurement\" and \"base\" are built in)");
    }
  }
  return frames;
}

/// Joint values of `near_deg` in SI, checked against the joints if the cell is known.
std::optional<model::JointVector> NearFromToml(const TomlTable& table,
                                               const std::optional<std::vector<double>>& values,
                                               const model::CellModel* cell) {
  if (!values || cell == nullptr) return std::nullopt;
  const int n = cell->robot.size();
  if (static_cast<int>(values->size()) != n) {
    table.AddFault("near_deg",
                   fmt::format("has {} values; the cell has {} joints", values->size(), n));
    return std::nullopt;
  }
  model::JointVector q(n);
  bool outside = false;
  for (int i = 0; i < n; ++i) {
    const model::Joint& joint = cell->robot.joints[static_cast<std::size_t>(i)];
    const double to_si = model::PositionForm(joint.type).to_SI;
    q[i] = (*values)[static_cast<std::size_t>(i)] * to_si;
    if (q[i] < joint.min || q[i] > joint.max) {
      table.AddFault("near_deg", fmt::format("has joint {} outside its limits {:g}..{:g}", i + 1,
                                             joint.min / to_si, joint.max / to_si));
      outside = true;
    }
  }
  if (outside) WarnAboutRadians(table, "near_deg");
  return q;
}

correction::AssemblyPoint PointFromToml(const TomlTable& table, const FrameTable& frames,
                                        const model::CellModel* cell) {
  PointKeys placed;
  ReadKeys(table, placed);
  correction::AssemblyPoint& point = placed.point;
  point.name = placed.name.empty() ? fmt::format("point {}", point.id) : placed.name;
  const auto found = frames.find(placed.frame);
  if (found == frames.end()) {
    std::string names;
    for (const auto& [name, pose] : frames) names += (names.empty() ? "" : ", ") + name;
    table.AddFault("frame", "is not a declared frame; declared are " + names);
  }
  const Pose X_OP = PoseOf(placed);
  point.X_WP = found == frames.end() ? X_OP : found->second * X_OP;
  point.near_q = NearFromToml(table, placed.near, cell);
  if (!table.Has("near_deg")) {
    table.AddWarning("near_deg",
                     "missing; the arm configuration will depend on where the robot is when the "
                     "daemon starts. Give the joint values at which the point was taught");
  }
  if (point.payload_kg.value_or(0) > 0 && cell != nullptr && !cell->payload_cog_F) {
    table.AddWarning("payload_kg", "cannot be used: the cell has no [payload] cog_mm");
  }
  if (cell != nullptr && found != frames.end()) WarnAboutUnlikelyPoint(table, X_OP.p, point, *cell);
  return point;
}

/// Reads the assembly points with their work-object frames. The frames "measurement" (the default)
/// and "base" (the robot's) exist without being declared.
///
/// @param cell  provides the base and the number, types and limits of the joints; null if the cell
///              could not be read, then nothing is checked against it
/// @return      the points in file order, with X_WP in the measurement frame
std::vector<correction::AssemblyPoint> PointsFromToml(const TomlTable& root,
                                                      const model::CellModel* cell) {
  const FrameTable frames = FramesFromToml(root, cell);
  std::vector<correction::AssemblyPoint> points;
  const std::vector<TomlTable> tables = root.Tables("point");
  if (static_cast<int>(tables.size()) > plc::registers::kMaxPoints) {
    root.AddFault("point", fmt::format("is given {} times; at most {} points", tables.size(),
                                       plc::registers::kMaxPoints));
  }
  for (const TomlTable& table : tables) {
    correction::AssemblyPoint point = PointFromToml(table, frames, cell);
    const bool known = std::any_of(points.begin(), points.end(),
                                   [&](const auto& other) { return other.id == point.id; });
    if (known && point.id != 0) table.AddFault("id", "is used for two points");
    points.push_back(std::move(point));
  }
  if (tables.empty()) root.AddWarning("point", "missing; no assembly point will be corrected");
  return points;
}

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

void CheckRtdeFields(const TomlTable& table, const robot::RtdeSettings& rtde) {
  const std::vector<std::string_view> known = robot::OptionalRtdeFields();
  for (const std::string& name : rtde.fields) {
    if (std::find(known.begin(), known.end(), name) != known.end()) continue;
    table.AddFault("rtde_fields", fmt::format("contains \"{}\", which is not one of {}", name,
                                              fmt::join(known, ", ")));
  }
}

RobotLinkConfig RobotLinkFromToml(const TomlTable& table, const NamedFiles& files,
                                  FaultList& faults) {
  RobotLinkConfig robot;
  robot::RobotConnection& connection = robot.connection;
  const std::optional<std::string> transport = table.String("transport");
  const bool rtde = transport == "rtde";
  if (rtde) connection.tcp.port = robot::kRtdePort;
  if (const auto file = files.ReadIf(!rtde, table, "profile", "profiles")) {
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
  CheckRtdeFields(table, connection.rtde);
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
  config.robot.connection.pushed_points = static_cast<int>(config.push_ids.size());
  if (push.enabled && config.push_ids.empty() && !table.Has("point_ids")) {
    table.AddMissing("point_ids", "the ids of the points to push");
  }
}

/// Reads the cell that the configuration names. @return  the cell file's text, or nothing if it has
/// faults or is missing
std::optional<std::string> ReadCell(const TomlTable& root, const NamedFiles& named,
                                    FaultList& faults, DaemonConfig& config) {
  const auto file = named.Read(root, "cell", "cells");
  if (!file) return std::nullopt;
  config.cell_file = file->first;
  const auto cell = CellFromText(file->second, file->first, faults);
  if (!cell) return std::nullopt;
  config.machine.cell = deflection::CellOfPoints(*cell);
  return file->second;
}

/// Reads every table of the configuration. @param of_others  the faults of the files that it names
void ReadTables(const TomlTable& root, const NamedFiles& named, bool cell_known,
                FaultList& of_others, DaemonConfig& config) {
  const model::CellModel* cell = cell_known ? &config.machine.cell : nullptr;
  if (const auto table = root.RequiredTable("robot")) {
    config.robot = RobotLinkFromToml(*table, named, of_others);
    ReadKeys(*table, config.machine.plausibility);
  }
  if (const auto table = root.Table("payload")) config.machine.payload = PayloadFromToml(*table);
  if (const auto table = root.Table("plc")) config.plc = PlcFromToml(*table);
  if (const auto table = root.Table("correction")) ReadKeys(*table, config.machine.limits);
  if (const auto table = root.Table("cycle")) {
    Settings keys(*table);
    ListCycleKeys(keys, config.cycle_period_s);
  }
  ReadKeys(root, config, &named);
  config.machine.points = PointsFromToml(root, cell);
  if (cell_known) WarnAboutHeavyPayloads(root, config.machine);
  config.gauges = GaugesFromToml(root, cell);
  if (const auto table = root.Table("push")) PushFromToml(*table, config);
  if (const auto table = root.Table("motion")) {
    const bool targets = config.robot.connection.push.enabled || !config.machine.points.empty();
    config.motion = MotionFromToml(*table, cell, targets);
  }
  config.machine.states_present_radius = config.motion.enabled;
  if (const auto table = root.Table("monitoring")) config.monitoring = MonitoringFromToml(*table);
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
    const auto why = config.page.token.empty() ? std::nullopt : WhyExposed(config.file);
    if (why) table->AddWarning("", config.file + " holds the page's token and " + *why);
  }
  if (const auto table = root.Table("mqtt")) {
    config.mqtt = MqttFromToml(*table, named, config.machine.cell.robot.name);
  }
}

/// Reads the configuration, the cell and the files that it names. @return  as ReadCell()
std::optional<std::string> ReadRoot(const TomlTable& root, const NamedFiles& named,
                                    FaultList& of_others, DaemonConfig& config) {
  std::optional<std::string> cell_text = ReadCell(root, named, of_others, config);
  ReadTables(root, named, cell_text.has_value(), of_others, config);
  CheckAcrossTables(root, config, cell_text.has_value());
  return cell_text;
}

}  // namespace

std::optional<DaemonConfig> DaemonConfigFromText(std::string_view text, const std::string& file,
                                                 const FileSource& files,
                                                 const std::string& data_directory,
                                                 FaultList& faults, std::size_t postures) {
  FaultList own;
  FaultList of_others;
  TomlDocument document(text, file, own);
  const NamedFiles named(file, files, data_directory);
  DaemonConfig config;
  config.file = file;
  if (!RefuseWrongFile(text, file, kWantedConfiguration, own) && document.parsed()) {
    const auto cell_text = ReadRoot(document.Root(), named, of_others, config);
    document.ReportMisplacedKeys(text, [&named](TomlDocument& copy) {
      FaultList ignored;
      DaemonConfig unused;
      ReadRoot(copy.Root(), named, ignored, unused);
    });
    document.ReportUnknownKeys(HeadersWithKey);
    if (cell_text && !own.HasFaults() && !of_others.HasFaults()) {
      // The cell is parsed again so that warnings about its base have a file and line.
      TomlDocument cell(*cell_text, config.cell_file, of_others);
      const bool own_base = !config.machine.cell.measurement.holds_points;
      WarnAboutUnlikelyPostures(document.Root(),
                                own_base ? cell.Root().Table("robot") : std::nullopt,
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
  return DaemonConfigFromText(text, file, files::ReadTextFile, InstalledDataDirectory(), faults,
                              postures);
}

std::optional<DaemonConfig> ReadDaemonConfig(const std::string& path, FaultList& faults,
                                             std::size_t postures) {
  const auto text = ReadRequiredFile(path, faults);
  return text ? DaemonConfigFromText(*text, path, faults, postures) : std::nullopt;
}

}  // namespace plumbline::config
