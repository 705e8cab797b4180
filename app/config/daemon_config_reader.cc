#include "app/config/daemon_config_reader.h"

#include <arpa/inet.h>
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <set>

#include "app/config/cell_reader.h"
#include "app/config/point_reader.h"
#include "app/config/robot_profile_reader.h"
#include "app/config/text_file.h"
#include "app/config/toml_reader.h"

namespace plumbline {
namespace {

constexpr double kSecondPerMs = 1e-3;
constexpr NumberRange kCyclePeriod{1, 1000, kSecondPerMs};
constexpr NumberRange kTimeout{5, 10000, kSecondPerMs};
constexpr NumberRange kStaleAfter{10, 60000, kSecondPerMs};
constexpr NumberRange kPushPeriod{10, 60000, kSecondPerMs};
constexpr NumberRange kPushStep{0.001, 100, kMetrePerMm};
constexpr NumberRange kMaxTranslation{0.01, 1000, kMetrePerMm};
constexpr NumberRange kMaxRotation{0.001, 90, kRadPerDeg};
constexpr NumberRange kSingularValue{0, 1};
constexpr NumberRange kShare{0, 1};
constexpr NumberRange kMass{0, 5000};
constexpr NumberRange kCog{-20000, 20000, kMetrePerMm};

/// Finds and reads the files that a configuration names.
class NamedFiles {
 public:
  NamedFiles(const std::string& config_file, const FileSource& files, std::string data_directory)
      : beside_(std::filesystem::path(config_file).parent_path()),
        data_(std::move(data_directory)),
        files_(files) {}

  /// Path and content of the file that `key` names; a fault at the key where there is none.
  /// `folder` is where a bare name without suffix is looked for.
  std::optional<std::pair<std::string, std::string>> Read(const TomlTable& table,
                                                          std::string_view key,
                                                          const std::string& folder) const {
    const auto name = table.RequiredString(key);
    if (!name) return std::nullopt;
    std::filesystem::path path(*name);
    if (!folder.empty() && !path.has_extension() && !path.has_parent_path()) {
      path = std::filesystem::path(folder) / (*name + ".toml");
    }
    std::string reason;
    for (const std::filesystem::path& directory : {beside_, data_}) {
      const std::string candidate = (directory / path).lexically_normal().string();
      Result<std::string> text = files_(candidate);
      if (text) return std::pair(candidate, std::move(text).value());
      reason += fmt::format("{}{}: {}", reason.empty() ? "" : "; ", candidate, text.error());
      if (path.is_absolute()) break;
    }
    table.AddFault(key, fmt::format("cannot be read ({})", reason));
    return std::nullopt;
  }

  std::string Beside(const std::string& path) const {
    return (beside_ / path).lexically_normal().string();
  }

 private:
  std::filesystem::path beside_, data_;
  const FileSource& files_;
};

bool IsAddress(const std::string& text) {
  in6_addr address;
  return inet_pton(AF_INET, text.c_str(), &address) == 1 ||
         inet_pton(AF_INET6, text.c_str(), &address) == 1;
}

/// A host by name or address; a text of digits and dots must be an address.
bool IsHost(const std::string& text) {
  constexpr std::string_view kNameCharacters =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789.-_";
  if (IsAddress(text)) return true;
  return text.size() <= 253 && text.find_first_not_of("0123456789.") != std::string::npos &&
         text.find_first_not_of(kNameCharacters) == std::string::npos;
}

SerialSettings SerialFromToml(const TomlTable& table, bool required) {
  SerialSettings serial;
  const auto device = required ? table.RequiredString("device") : table.String("device");
  serial.device = device.value_or("");
  if (device && device->front() != '/') {
    table.AddFault("device", "is not an absolute path such as /dev/ttyUSB0");
  }
  serial.baud = table.Integer("baud", 1200, 921600).value_or(serial.baud);
  constexpr int kRates[] = {1200,  2400,   4800,   9600,   19200, 38400,
                            57600, 115200, 230400, 460800, 921600};
  if (std::find(std::begin(kRates), std::end(kRates), serial.baud) == std::end(kRates)) {
    table.AddFault("baud", "is not a usual rate (9600, 19200, 38400, 57600, 115200, ...)");
  }
  serial.parity =
      table.OneOf<char>("parity", {{"N", 'N'}, {"E", 'E'}, {"O", 'O'}}).value_or(serial.parity);
  serial.stop_bits = table.Integer("stop_bits", 1, 2).value_or(serial.stop_bits);
  return serial;
}

RobotLinkConfig RobotFromToml(const TomlTable& table, const NamedFiles& files, FaultList& faults) {
  using Transport = RobotLinkConfig::Transport;
  RobotLinkConfig robot;
  if (const auto file = files.Read(table, "profile", "profiles")) {
    if (auto profile = RobotProfileFromText(file->second, file->first, faults)) {
      robot.profile = std::move(*profile);
      robot.port = robot.profile.port;
      robot.unit_id = robot.profile.unit_id;
    }
  }
  robot.transport = table
                        .OneOf<Transport>("transport", {{"tcp", Transport::kTcp},
                                                        {"rtu", Transport::kRtu},
                                                        {"replay", Transport::kReplay}})
                        .value_or(Transport::kTcp);
  const bool tcp = robot.transport == Transport::kTcp;
  const auto host = tcp ? table.RequiredString("host") : table.String("host");
  robot.host = host.value_or(robot.host);
  if (host && !IsHost(*host)) table.AddFault("host", "is not a host name or address");
  robot.port = table.Integer("port", 1, 65535).value_or(robot.port);
  robot.unit_id = table.Integer("unit_id", 0, 255).value_or(robot.unit_id);
  robot.serial = SerialFromToml(table, robot.transport == Transport::kRtu);
  if (robot.transport == Transport::kReplay) {
    if (const auto file = files.Read(table, "replay_file", "")) robot.replay_file = file->first;
  } else {
    static_cast<void>(table.String("replay_file"));
  }
  robot.timeout_s = table.Number("timeout_ms", kTimeout).value_or(robot.timeout_s);
  robot.stale_after_s = table.Number("stale_after_ms", kStaleAfter).value_or(robot.stale_after_s);
  return robot;
}

PayloadConfig PayloadFromToml(const TomlTable& table) {
  using Source = PayloadConfig::Source;
  PayloadConfig payload;
  payload.source = table
                       .OneOf<Source>("source", {{"robot", Source::kRobot},
                                                 {"table", Source::kTable},
                                                 {"fixed", Source::kFixed}})
                       .value_or(Source::kRobot);
  const bool fixed = payload.source == Source::kFixed;
  payload.mass_kg =
      (fixed ? table.RequiredNumber("mass_kg", kMass) : table.Number("mass_kg", kMass)).value_or(0);
  payload.cog_F = table.Vector3("cog_mm", kCog);
  std::set<int> numbers;
  for (const TomlTable& tool : table.Tables("tool")) {
    const auto number = tool.RequiredInteger("number", 0, 65535);
    if (number && !numbers.insert(*number).second) {
      tool.AddFault("number", "is the number of two tools");
    }
    payload.table.push_back({.number = number.value_or(0),
                             .mass_kg = tool.RequiredNumber("mass_kg", kMass).value_or(0),
                             .cog_F = tool.Vector3("cog_mm", kCog)});
  }
  if (payload.source == Source::kTable && !table.Has("tool")) {
    table.AddMissing("tool", "one [[payload.tool]] for each tool number, as source is \"table\"");
  }
  return payload;
}

PlcConfig PlcFromToml(const TomlTable& table) {
  PlcConfig plc;
  plc.listen = table.String("listen").value_or(plc.listen);
  if (!IsAddress(plc.listen)) {
    table.AddFault("listen",
                   "is not an address such as 192.168.0.10, or 0.0.0.0 for every network");
  }
  plc.port = table.Integer("port", 0, 65535).value_or(plc.port);
  plc.unit_id = table.Integer("unit_id", 1, 247).value_or(plc.unit_id);
  plc.little_word_first =
      table.OneOf<bool>("word_order", {{"ABCD", false}, {"CDAB", true}}).value_or(false);
  plc.orientation =
      table
          .OneOf<OrientationConvention>(
              "orientation", {{"rotation_vector", OrientationConvention::kRotationVector},
                              {"roll_pitch_yaw", OrientationConvention::kRollPitchYaw},
                              {"a_b_c", OrientationConvention::kAbc}})
          .value_or(plc.orientation);
  plc.max_clients = table.Integer("max_clients", 1, 256).value_or(plc.max_clients);
  plc.allow = table.Strings("allow").value_or(std::vector<std::string>{});
  for (const std::string& address : plc.allow) {
    if (!IsAddress(address)) {
      table.AddFault("allow", fmt::format("has \"{}\", which is not an address", address));
    }
  }
  if (const auto rtu = table.Table("rtu")) plc.rtu = SerialFromToml(*rtu, true);
  return plc;
}

CorrectionConfig CorrectionFromToml(const TomlTable& table) {
  CorrectionConfig c;
  c.max_translation_m =
      table.Number("max_translation_mm", kMaxTranslation).value_or(c.max_translation_m);
  c.max_rotation_rad = table.Number("max_rotation_deg", kMaxRotation).value_or(c.max_rotation_rad);
  c.min_singular_value =
      table.Number("min_singular_value", kSingularValue).value_or(c.min_singular_value);
  c.deflection_sd = table.Number("deflection_sd", kShare).value_or(c.deflection_sd);
  return c;
}

PushConfig PushFromToml(const TomlTable& table, const std::vector<AssemblyPoint>& points) {
  PushConfig push;
  push.enabled = table.Bool("enabled").value_or(false);
  push.point_ids = table.Integers("point_ids", 1, 65535).value_or(std::vector<int>{});
  push.max_step_m = table.Number("max_step_mm", kPushStep).value_or(push.max_step_m);
  push.min_period_s = table.Number("min_period_ms", kPushPeriod).value_or(push.min_period_s);
  std::set<int> seen;
  for (const int id : push.point_ids) {
    const bool known = std::any_of(points.begin(), points.end(),
                                   [id](const AssemblyPoint& point) { return point.id == id; });
    if (!known) table.AddFault("point_ids", fmt::format("names {}, which is no [[point]]", id));
    if (!seen.insert(id).second) table.AddFault("point_ids", fmt::format("names {} twice", id));
  }
  if (push.enabled && push.point_ids.empty() && !table.Has("point_ids")) {
    table.AddMissing("point_ids", "the ids of the points to push");
  }
  return push;
}

/// What the profile offers must carry what the configuration asks of it.
void CheckAgainstProfile(const TomlTable& root, const DaemonConfig& config, bool cell_known) {
  using Source = PayloadConfig::Source;
  const RobotProfile& profile = config.robot.profile;
  const auto robot = root.Table("robot");
  const auto payload = root.Table("payload");
  const auto push = root.Table("push");
  const auto joints = static_cast<int>(profile.joints.size());
  if (cell_known && robot && joints != config.cell.robot.size()) {
    robot->AddFault(
        "profile", fmt::format("has {} joints; the cell has {}", joints, config.cell.robot.size()));
  }
  if (config.robot.transport == RobotLinkConfig::Transport::kReplay) {
    if (config.push.enabled && push) push->AddFault("enabled", "is not possible with a replay");
    return;
  }
  if (config.payload.source == Source::kRobot && !profile.payload_mass) {
    const std::string what = fmt::format(
        "the profile {} reads no payload mass; use \"table\" or \"fixed\"", profile.name);
    if (payload) payload->AddFault("source", "cannot be used: " + what);
    if (!payload) root.AddWarning("payload", "missing: " + what);
  }
  if (config.payload.source == Source::kTable && !profile.tool_number && payload) {
    payload->AddFault(
        "source",
        fmt::format("needs a tool number, which the profile {} does not read", profile.name));
  }
  if (!push || !config.push.enabled) return;
  const int slots = profile.push ? profile.push->slots : 0;
  if (slots == 0) {
    push->AddFault("enabled", fmt::format("needs a [push] in the profile {}", profile.name));
  } else if (static_cast<int>(config.push.point_ids.size()) > slots) {
    push->AddFault("point_ids", fmt::format("has {} ids; the profile {} has {} slots",
                                            config.push.point_ids.size(), profile.name, slots));
  }
}

}  // namespace

std::optional<DaemonConfig> DaemonConfigFromText(std::string_view text, const std::string& file,
                                                 const FileSource& files,
                                                 const std::string& data_directory,
                                                 FaultList& faults) {
  FaultList own;
  FaultList of_others;
  TomlDocument document(text, file, own);
  DaemonConfig config;
  config.file = file;
  if (document.parsed()) {
    const TomlTable root = document.Root();
    const NamedFiles named(file, files, data_directory);
    bool cell_known = false;
    if (const auto cell_file = named.Read(root, "cell", "cells")) {
      config.cell_file = cell_file->first;
      if (auto cell = CellFromText(cell_file->second, cell_file->first, of_others)) {
        config.cell = std::move(*cell);
        cell_known = true;
      }
    }
    const auto robot = root.RequiredTable("robot");
    if (robot) config.robot = RobotFromToml(*robot, named, of_others);
    if (const auto table = root.Table("payload")) config.payload = PayloadFromToml(*table);
    if (const auto table = root.Table("plc")) config.plc = PlcFromToml(*table);
    if (const auto table = root.Table("correction")) config.correction = CorrectionFromToml(*table);
    if (const auto table = root.Table("cycle")) {
      config.cycle_period_s =
          table->Number("period_ms", kCyclePeriod).value_or(config.cycle_period_s);
    }
    config.state_directory =
        named.Beside(root.String("state_directory").value_or(config.state_directory));
    config.points = PointsFromToml(root, cell_known ? &config.cell : nullptr);
    if (const auto table = root.Table("push")) config.push = PushFromToml(*table, config.points);
    if (robot && config.robot.stale_after_s < config.cycle_period_s) {
      robot->AddFault("stale_after_ms",
                      fmt::format("is below the cycle of {:g} ms, so that input is always stale",
                                  config.cycle_period_s / kSecondPerMs));
    }
    if (!config.robot.profile.joints.empty()) CheckAgainstProfile(root, config, cell_known);
    document.ReportUnknownKeys();
  }
  own.SortByLine();
  faults.Append(own);
  faults.Append(of_others);
  if (own.HasFaults() || of_others.HasFaults()) return std::nullopt;
  return config;
}

std::optional<DaemonConfig> DaemonConfigFromText(std::string_view text, const std::string& file,
                                                 FaultList& faults) {
  return DaemonConfigFromText(text, file, ReadTextFile, PLUMBLINE_DATADIR, faults);
}

std::optional<DaemonConfig> ReadDaemonConfig(const std::string& path, FaultList& faults) {
  const Result<std::string> text = ReadTextFile(path);
  if (!text) {
    faults.Add({Fault::Severity::kFault, path, 0, "", "cannot be read: " + text.error()});
    return std::nullopt;
  }
  return DaemonConfigFromText(*text, path, faults);
}

}  // namespace plumbline
