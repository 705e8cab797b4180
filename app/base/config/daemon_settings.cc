#include "app/base/config/daemon_settings.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <system_error>
#include <tuple>
#include <utility>

#include "app/base/config/limits.h"
#include "app/base/text/text.h"
#include "firmware-like/status/gauge_status.h"

namespace plumbline::config {
namespace {

using status::kMaxGauges;

/// Adds a fault unless the cell has a gauge of that name.
void CheckArtefact(const TomlTable& table, const std::string& name, const model::CellModel& cell) {
  const auto found =
      std::find_if(cell.artefacts.begin(), cell.artefacts.end(),
                   [&name](const model::Artefact& artefact) { return artefact.name == name; });
  if (found == cell.artefacts.end()) {
    std::vector<std::string> names;
    for (const model::Artefact& artefact : cell.artefacts) {
      if (artefact.kind == model::ArtefactKind::kGauge) names.push_back(artefact.name);
    }
    const std::string nearest = text::NearestWord(name, names, 0.4);
    table.AddFault("artefact",
                   nearest.empty()
                       ? "is not an [[artefact]] of the cell; add one of kind \"gauge\""
                       : "is not an [[artefact]] of the cell; did you mean " + nearest + "?");
  } else if (found->kind != model::ArtefactKind::kGauge) {
    table.AddFault("artefact", "is not of kind \"gauge\" in the cell");
  }
}

/// "0fe7:4001", as lsusb prints it; nullopt: not of this form.
std::optional<std::pair<int, int>> UsbIdFrom(std::string_view text) {
  constexpr std::size_t kDigits = 4;
  if (text.size() != 2 * kDigits + 1 || text[kDigits] != ':') return std::nullopt;
  const auto number = [](std::string_view digits) -> std::optional<int> {
    int value = 0;
    const char* const end = digits.data() + digits.size();
    const auto [stop, error] = std::from_chars(digits.data(), end, value, 16);
    if (error != std::errc() || stop != end || value < 0) return std::nullopt;
    return value;
  };
  const auto vendor = number(text.substr(0, kDigits)), product = number(text.substr(kDigits + 1));
  if (!vendor || !product) return std::nullopt;
  return std::pair(*vendor, *product);
}

/// Adds faults for keys that the kind needs, and for those that it does not have.
void CheckKindKeys(const TomlTable& table, const GaugeKeys& keys) {
  const bool hid = keys.kind == gauge::GaugeKind::kHid;
  if (hid && keys.usb_id.empty()) {
    table.AddFault("usb_id", "is missing; lsusb shows it: ID 0fe7:4001");
  }
  if (!hid && keys.device.empty()) {
    table.AddFault("device", "is missing; ls /dev/serial/by-id shows the name");
  }
  const auto refuse = [&](std::string_view key, bool given, const char* of) {
    if (given) {
      table.AddFault(
          key, fmt::format("is for kind = \"{0}\" only: remove it, or set kind = \"{0}\"", of));
    }
  };
  refuse("device", hid && !keys.device.empty(), "serial");
  refuse("baud", hid && keys.baud, "serial");
  refuse("data_bits", hid && keys.data_bits, "serial");
  refuse("parity", hid && keys.parity, "serial");
  refuse("stop_bits", hid && keys.stop_bits, "serial");
  refuse("usb_id", !hid && !keys.usb_id.empty(), "hid");
  refuse("serial", !hid && !keys.serial.empty(), "hid");
}

GaugeConfig GaugeFromToml(const TomlTable& table) {
  GaugeKeys keys;
  ReadKeys(table, keys);
  CheckKindKeys(table, keys);
  GaugeConfig found;
  found.artefact = keys.artefact;
  found.sigma_m = keys.sigma_m;
  found.connection.kind = keys.kind;
  found.connection.device = keys.device;
  found.connection.unit = keys.unit;
  found.connection.hid.serial = keys.serial;
  if (!keys.usb_id.empty()) {
    const auto id = UsbIdFrom(keys.usb_id);
    if (!id) table.AddFault("usb_id", "is not of the form 0fe7:4001 (lsusb shows it)");
    std::tie(found.connection.hid.vendor_id, found.connection.hid.product_id) =
        id.value_or(std::pair(0, 0));
  }
  const bool hid = keys.kind == gauge::GaugeKind::kHid;
  found.connection.format =
      keys.format.value_or(gauge::FindGaugeFormat(hid ? "plain" : "mitutoyo"));
  if (hid) return found;
  os::SerialSettings& line = found.connection.line;
  line = found.connection.format->line;
  line.baud = keys.baud.value_or(line.baud);
  line.data_bits = keys.data_bits.value_or(line.data_bits);
  line.stop_bits = keys.stop_bits.value_or(line.stop_bits);
  line.parity = keys.parity.value_or(line.parity);
  if (const std::string fault = os::FaultOf(line); !fault.empty()) table.AddFault("baud", fault);
  return found;
}

}  // namespace

std::vector<GaugeConfig> GaugesFromToml(const TomlTable& root, const model::CellModel* cell) {
  std::vector<GaugeConfig> gauges;
  const std::vector<TomlTable> tables = root.Tables("gauge");
  if (tables.size() > kMaxGauges) {
    root.AddFault("gauge",
                  fmt::format("is given {} times; at most {} gauges", tables.size(), kMaxGauges));
  }
  for (const TomlTable& table : tables) {
    GaugeConfig one = GaugeFromToml(table);
    if (cell != nullptr && !one.artefact.empty()) CheckArtefact(table, one.artefact, *cell);
    for (const GaugeConfig& other : gauges) {
      if (!one.artefact.empty() && other.artefact == one.artefact) {
        table.AddFault("artefact", "is used for two gauges");
      }
      if (!one.connection.device.empty() && other.connection.device == one.connection.device) {
        table.AddFault("device", "is used for two gauges");
      }
      const bool both_hid = one.connection.kind == gauge::GaugeKind::kHid &&
                            other.connection.kind == gauge::GaugeKind::kHid;
      const hid::HidName &name = one.connection.hid, &taken = other.connection.hid;
      const bool same_device =
          name.vendor_id == taken.vendor_id && name.product_id == taken.product_id &&
          (name.serial.empty() || taken.serial.empty() || name.serial == taken.serial);
      if (both_hid && same_device) {
        table.AddFault("usb_id", "is used for two gauges; distinguish them by `serial`");
      }
    }
    if (!one.connection.device.empty() && one.connection.device.front() != '/') {
      table.AddFault("device", "is not the path of a device, such as /dev/serial/by-id/...");
    }
    gauges.push_back(std::move(one));
  }
  return gauges;
}

namespace {

constexpr double kBytesPerMB = 1e6;
constexpr NumberRange kPort{1, 65535}, kPortOrAny{0, 65535}, kId{1, 65535};
constexpr NumberRange kPayloadMass{0, loads::kMaxPayload_kg};
constexpr NumberRange kCog{-20000, 20000, kMetrePerMm};

/// @tparam Line  SerialLine or modbus::RtuSlaveOptions
template <typename Line>
void ListSerialKeys(Settings& keys, Line& line, bool required, int max_baud,
                    const SettingDoc& device) {
  SettingDoc needed = device;
  needed.required = required;
  keys.Add("device", line.device, needed);
  keys.Add("baud", line.baud, {1200, static_cast<double>(max_baud)},
           {"standard baud rate in bit/s"});
  keys.Choose("parity", line.parity, {{"N", 'N'}, {"E", 'E'}, {"O", 'O'}}, {"none, even or odd"});
  keys.Add("stop_bits", line.stop_bits, {1, 2}, {"stop bits"});
}

void ListRtdeKeys(Settings& keys, robot::RtdeSettings& rtde) {
  constexpr double kLast = robot::rtde::kInputRegisters - 1;
  keys.Add(
      "rtde_hz", rtde.frequency_hz, {1, 500},
      {"for \"rtde\", like all rtde_ keys: data packages a second; a CB3 sends up to 125, newer "
       "controllers up to 500. For 500, set [cycle] period_ms = 2"});
  keys.Add("rtde_fields", rtde.fields,
           {"optional fields that are read; one that the controller lacks is left out"});
  keys.Add("rtde_tool_register", rtde.tool_number_register, {0, kLast},
           {"output integer register in which the robot program keeps the tool number", "24"});
  keys.Add("rtde_item_register", rtde.payload_item_register, {0, kLast},
           {"output integer register with the number of the payload item; 0 in it: none", "25"});
  keys.Add("rtde_first_int", rtde.push.first_int, {0, kLast},
           {"first input integer register that [push] writes: heartbeat, then sequence, id and "
            "radius in micrometres of each point"});
  keys.Add("rtde_first_double", rtde.push.first_double, {0, kLast},
           {"first input double register that [push] writes: x, y, z in m and the rotation vector "
            "of each point"});
}

void ListDiagnosisKeys(Settings& keys, MonitoringConfig& monitoring) {
  using Apply = MonitoringConfig::Apply;
  keys.Add(
      "diagnose", monitoring.diagnose,
      {"after a drift alarm, look for the effect that the model lacks (runs at low priority)"});
  keys.Add("probes_before_diagnosis", monitoring.probes_before_diagnosis, {0, 10000},
           {"probes needed since the change began"});
  keys.Add("diagnosis_timeout_s", monitoring.diagnosis_timeout_s, {1, 86400},
           {"time limit of one diagnosis"});
  keys.Choose("apply", monitoring.apply, {{"ask", Apply::kAsk}, {"automatic", Apply::kAutomatic}},
              {"\"ask\": a person applies a proposed model with `plumbline model apply N`; "
               "\"automatic\": the daemon applies it if the diagnosis explains the residual by "
               "plausible, named effects, the held-out error falls, and neither a measured tip nor "
               "the command of a configured point moves by more than max_change_mm"});
  keys.Add("max_change_mm", monitoring.max_change_m, {0.001, 100, kMetrePerMm},
           {"largest change that is applied automatically"});
}

}  // namespace

void ListKeys(Settings& keys, DaemonConfig& config) {
  keys.Document("cell", "text",
                FirstCell(1, "model of the arm and its tool: edit a copy of one in cells/",
                          "\"cells/ur10.toml\""));
  keys.Path("state_directory", config.state_directory,
            {"directory for boot counter, journal, models and lenses"});
}

void ListKeys(Settings& keys, RobotLinkConfig& robot) {
  robot::RobotConnection& connection = robot.connection;
  keys.Document(
      "profile", "text",
      FirstCell(2, "register map of the controller", "\"profiles/universal-robots.toml\""));
  keys.Choose("transport", robot.transport,
              {{"tcp", "tcp"}, {"rtu", "rtu"}, {"rtde", "rtde"}, {"replay", "replay"}},
              {"Modbus TCP, Modbus RTU (serial line), RTDE of Universal Robots (needs no profile), "
               "or playback of a recorded table"});
  keys.Add("host", connection.tcp.host,
           FirstCell(3, "for \"tcp\" and \"rtde\": host name or IP address of the controller",
                     "\"192.168.0.2\"", robot.transport == "tcp" || robot.transport == "rtde"));
  keys.Add("port", connection.tcp.port, kPort,
           {.description = "for \"tcp\" and \"rtde\"",
            .default_text = "from the profile; 30004 for \"rtde\""});
  keys.Add("unit_id", connection.unit_id, {0, 255},
           {.description = "Modbus unit id; 248..254 are reserved, 255 only over TCP",
            .default_text = "from the profile"});
  keys.Add("timeout_ms", connection.timeout_s, {5, 10000, kSecondPerMs},
           {"timeout of one request; on a serial line plus the time of the longest frame"});
  ListSerialKeys(keys, connection.serial, robot.transport == "rtu", 921600,
                 {"for \"rtu\", like the next three: serial device", "\"/dev/ttyUSB0\""});
  ListRtdeKeys(keys, connection.rtde);
  keys.Document("replay_file", "text",
                {"for \"replay\": table whose q<i>_deg columns are played back", "\"run.csv\""});
  keys.Add("replay_rows_per_s", connection.replay.rows_per_s, {0.001, 1000},
           {"playback rate; rows that are too far apart are rejected as jumps"});
  keys.Add("replay_loop", connection.replay.loop,
           {"false: hold the last row, like a robot at standstill"});
}

void ListKeys(Settings& keys, PlausibilityLimits& limits) {
  keys.Add("stale_after_ms", limits.stale_after_s, {10, 60000, kSecondPerMs},
           {"robot data whose first request is longer ago are stale: every corrected point is "
            "withdrawn"});
}

void ListKeys(Settings& keys, PayloadPolicy& payload) {
  using Source = PayloadPolicy::Source;
  keys.Choose("source", payload.source,
              {{"robot", Source::kRobot}, {"table", Source::kTable}, {"fixed", Source::kFixed}},
              FirstCell(4,
                        "read from the controller, looked up in a table by tool number, or "
                        "constant",
                        "\"fixed\"", false));
  keys.Add("mass_kg", payload.fixed.mass_kg, kPayloadMass,
           FirstCell(5, "for \"fixed\"", "2.0", payload.source == Source::kFixed));
  keys.Add("cog_mm", payload.fixed.cog_F, kCog,
           {"centre of gravity in the flange frame", "[0.0, 0.0, 60.0]",
            "from the controller or the cell"});
}

void ListKeys(Settings& keys, PayloadPolicy::ToolLoad& tool) {
  keys.Add("number", tool.number, kPortOrAny,
           Required("tool number that the controller reports", "1"));
  keys.Add("mass_kg", tool.mass_kg, kPayloadMass, Required("payload with this tool", "2.0"));
  keys.Add("cog_mm", tool.cog_F, kCog,
           {"its centre of gravity in the flange frame", "[0.0, 0.0, 60.0]",
            "from the controller or the cell"});
}

void ListKeys(Settings& keys, PlcConfig& plc) {
  keys.Add("listen", plc.tcp.address,
           FirstCell(6, "IP address to listen on, in the PLC's network; 0.0.0.0: all networks",
                     "\"0.0.0.0\"", false));
  keys.Add("port", plc.tcp.port, kPortOrAny, {"0: any free port, reported in the log"});
  keys.Add("unit_id", plc.tcp.unit_id, {1, 247},
           {"Modbus unit id; 0, 1 and 255 are always answered too"});
  keys.Choose("word_order", plc.convention.little_word_first, {{"ABCD", false}, {"CDAB", true}},
              {"order of 32-bit values: high word first or low word first"});
  keys.Choose("orientation", plc.convention.orientation,
              {{"rotation_vector", OrientationConvention::kRotationVector},
               {"roll_pitch_yaw", OrientationConvention::kRollPitchYaw},
               {"a_b_c", OrientationConvention::kAbc},
               {"quaternion", OrientationConvention::kQuaternion}},
              {"how orientations are expressed; roll_pitch_yaw: Rz(yaw) Ry(pitch) Rx(roll), a_b_c: "
               "Rz(A) Ry(B) Rx(C), quaternion: x, y, z in place of the angles, w in registers of "
               "its own"});
  keys.Add("max_clients", plc.tcp.max_clients, {1, 256}, {"largest number of connected clients"});
  keys.Add("allow", plc.tcp.allow,
           {"IP addresses of the clients that may connect", "[\"192.168.0.10\"]", "every client"});
}

void ListKeys(Settings& keys, modbus::RtuSlaveOptions& line) {
  ListSerialKeys(keys, line, true, 115200, {"serial device", "\"/dev/ttyUSB1\""});
}

void ListKeys(Settings& keys, correction::CorrectionLimits& limits) {
  keys.Add(
      "max_translation_mm", limits.max_translation_m, {0.01, 1000, kMetrePerMm},
      {"a larger correction is refused (code 4); a probe farther from the prediction than this "
       "plus 10 mrad times the reach is quarantined"});
  keys.Add("max_rotation_deg", limits.max_rotation_rad, {0.001, 90, kRadPerDeg},
           {"a correction that rotates the tool more is refused (code 4)"});
  keys.Add("min_singular_value", limits.min_singular_value, {0, 1},
           {"smallest singular value of the tip Jacobian; below it the arm is too close to a "
            "singularity"});
  std::optional<double> share;
  keys.Add("deflection_sd", share, {0, 1},
           {"relative standard deviation of the declared deflections; if given, the radius of a "
            "fully declared cell has the basis \"propagated\" instead of \"assumed\"",
            "0.1"});
  if (share) limits.deviation = {*share, true};
}

void ListKeys(Settings& keys, robot::PushLimits& push, std::vector<int>& ids) {
  keys.Add("enabled", push.enabled, {"false: nothing is written"});
  keys.Add("point_ids", ids, kId,
           {"points to write, in the order of the profile's slots or of RTDE's", "[1]"});
  keys.Add("max_step_mm", push.max_step_m, {0.001, 100, kMetrePerMm},
           {"a point that jumps further is withdrawn before it is written again"});
  keys.Add("min_period_ms", push.min_period_s, {10, 60000, kSecondPerMs},
           {"shortest time between two writes of a point; over RTDE, where a point is in every "
            "package, until a withdrawn one is written again"});
}

void ListKeys(Settings& keys, MonitoringConfig& monitoring) {
  keys.Add("enabled", monitoring.enabled, {"true: probes that the PLC submits are recorded"});
  keys.Add("session", monitoring.session,
           {"session label of the recorded probes; the boot number is added", "\"1\""});
  keys.Add("probe_sigma_mm", monitoring.probe_sigma_m, {0.001, 10, kMetrePerMm},
           {"standard deviation of one probe, per axis"});
  keys.Add("reference_probes", monitoring.reference_probes, {0, 100},
           {"5 or more: drift is a change from the mean of the first probes, which is refused as a "
            "reference if they disagree; 0: drift is a deviation from the model itself"});
  keys.Add("reference_sd_mm", monitoring.reference_sd_m, {0, 10, kMetrePerMm},
           {"for reference_probes = 0: standard deviation of the model's mean residual"});
  keys.Add("shift_mm", monitoring.shift_m, {0.001, 100, kMetrePerMm},
           {"size of the change that must be detected quickly"});
  keys.Add("probes_per_day", monitoring.probes_per_day, {0.01, 86400},
           {"expected number; sets the alarm threshold together with the next key"});
  keys.Add("false_alarms_per_year", monitoring.false_alarms_per_year, {0.001, 100},
           {"acceptable rate of false alarms"});
  ListDiagnosisKeys(keys, monitoring);
  keys.Add("journal_mb", monitoring.journal_bytes, {1, 1e6, kBytesPerMB},
           {"largest size of the journal, about 330 bytes per probe; probes are refused when it is "
            "full"});
}

void ListKeys(Settings& keys, PageConfig& page) {
  keys.Add("port", page.port, kPortOrAny,
           {"0: any free port; if the key is missing there is no page", "8080"});
  keys.Add("listen", page.listen,
           {"IP address of this computer; one that other computers reach requires a token"});
  keys.Add(
      "token", page.token,
      {"password for the page: what `plumbline token` prints", "\"what-plumbline-token-prints\""});
  keys.Add(
      "hosts", page.hosts,
      {"further host names that browsers may use for this computer", "[\"cell7.plant.example\"]"});
}

void ListKeys(Settings& keys, MqttConfig& mqtt) {
  keys.Add("host", mqtt.host,
           Required("host name or IP address of the broker", "\"broker.plant.lan\""));
  keys.Add("port", mqtt.port, kPort, {.default_text = "1883; 8883 with tls_ca"});
  keys.Path("tls_ca", mqtt.tls_ca,
            {"CA certificates that verify the broker; if missing, the connection is not encrypted",
             "\"plant-ca.pem\""});
  keys.Add("username", mqtt.username, {"used together with password_file", "\"cell-7\""});
  keys.Path("password_file", mqtt.password_file,
            {"file with the password in its first line; only the user plumbline may read it",
             "\"mqtt-password\""});
  keys.Add("group", mqtt.group, {"part of every topic: plumblineV1/GROUP/.../NODE"});
  keys.Add("node", mqtt.node, {"name of this cell, unique", "\"cell-7\"", "the arm's name"});
  keys.Add("client_id", mqtt.client_id,
           {"MQTT client id, unique", "\"cell-7\"", "plumbline-GROUP-NODE"});
  keys.Add("state_s", mqtt.state_period_s, {0.2, 3600},
           {"interval between state messages while nothing changes"});
  keys.Add("change_s", mqtt.change_period_s, {0.2, 3600},
           {"shortest interval between two messages about the same changing value"});
  keys.Add("point_change_mm", mqtt.point_change_m, {0.001, 100, kMetrePerMm},
           {"smaller changes of a correction are not published"});
  keys.Add("queue_mb", mqtt.queue_bytes, {1, 100000, kBytesPerMB},
           {"largest size of the queue on disk while the broker is unreachable"});
  keys.Add("repeat_s", mqtt.repeat_s, {0, 3600},
           {"a message is kept this long after the broker accepted it, and published again if the "
            "connection breaks meanwhile: longer than the broker takes to save; 0: not kept"});
  keys.Add("page_url", mqtt.page_url,
           {"address of this cell's page, for links in the plant",
            "\"https://cell7.plant.example:8443/\"", "from [page], if other computers reach it"});
  keys.Add("journal", mqtt.journal, {"publish each recorded probe, once"});
}

void ListCycleKeys(Settings& keys, double& period_s) {
  keys.Add("period_ms", period_s, {1, 1000, kSecondPerMs}, {"cycle time"});
}

void ListKeys(Settings& keys, GaugeKeys& gauge) {
  keys.Add("artefact", gauge.artefact,
           Required("name of the [[artefact]] of kind \"gauge\" in the cell", "\"dial\""));
  keys.Choose("kind", gauge.kind,
              {{"serial", gauge::GaugeKind::kSerial}, {"hid", gauge::GaugeKind::kHid}},
              {"a serial line, also a virtual one; or a HID device, which types or sends reports"});
  keys.Add("device", gauge.device,
           {"required for \"serial\": the line of the gauge or of its adapter",
            "\"/dev/serial/by-id/...\""});
  keys.Add("usb_id", gauge.usb_id,
           {"required for \"hid\": vendor and product, as lsusb shows them", "\"0fe7:4001\""});
  keys.Add("serial", gauge.serial,
           {"for \"hid\": serial number, to distinguish identical devices", "\"A1\""});
  std::vector<Choice<std::optional<const gauge::GaugeFormat*>>> formats;
  for (const gauge::GaugeFormat& format : gauge::GaugeFormats()) {
    formats.push_back({format.name, &format});
  }
  keys.Choose("format", gauge.format, formats,
              {"what it sends: \"mitutoyo\" 01A+0000.123, \"starrett\" + 2.1380, MM, \"sylvac\" "
               "+12.345, \"mahr\" 1 +123.45 mm, \"plain\" -0.125 mm",
               "\"mitutoyo\"", "\"mitutoyo\", of \"hid\" \"plain\""});
  constexpr std::string_view kOfFormat = "that of the format";
  keys.Add("baud", gauge.baud, {1200, 115200}, {"standard baud rate in bit/s", "9600", kOfFormat});
  keys.Add("data_bits", gauge.data_bits, {7, 8}, {"data bits", "8", kOfFormat});
  keys.Choose("parity", gauge.parity, {{"N", 'N'}, {"E", 'E'}, {"O", 'O'}},
              {"none, even or odd", "\"N\"", kOfFormat});
  keys.Add("stop_bits", gauge.stop_bits, {1, 2}, {"stop bits", "1", kOfFormat});
  keys.Choose("unit", gauge.unit,
              {{"mm", gauge::GaugeUnit::kMillimetre}, {"inch", gauge::GaugeUnit::kInch}},
              {"unit that the gauge is set to; used only if it does not send the unit"});
  keys.Add("sigma_mm", gauge.sigma_m, {1e-5, 10, kMetrePerMm},
           {"standard deviation of a reading", "0.002", "that of the cell"});
}

void ListKeys(Settings& keys, FrameKeys& frame) {
  keys.Add("name", frame.name, FirstCell(0, "", "\"fixture\""));
  keys.Add("xyz_mm", frame.xyz_m, kPlaceRange,
           FirstCell(7, "position in the measurement frame", ""));
  keys.Add("rpy_deg", frame.rpy_rad, kTurnRange,
           FirstCell(0, "orientation, R = Rz(yaw) Ry(pitch) Rx(roll)", "", false));
}

void ListKeys(Settings& keys, PointKeys& placed) {
  correction::AssemblyPoint& point = placed.point;
  keys.Add("id", point.id, kId, FirstCell(8, "number by which the PLC requests the point", "1"));
  keys.Add("name", placed.name,
           {.example = "\"left bracket\"", .default_text = "point ID", .active = true});
  keys.Add("frame", placed.frame, FirstCell(0, "frame of the pose below", "\"fixture\"", false));
  keys.Add("xyz_mm", placed.xyz_m, kPlaceRange,
           FirstCell(9, "target position of the *loaded* tool point", "[700.0, -200.0, 400.0]"));
  keys.Add("rpy_deg", placed.rpy_rad, kTurnRange,
           FirstCell(10, "target orientation", "[180.0, 0.0, 0.0]", false));
  keys.Add("tool_point_mm", point.p_TP, {-5000, 5000, kMetrePerMm},
           {"contact point of the tool in the tip frame"});
  keys.Add("near_deg", placed.near, {-100000, 100000},
           {"joint values at which the point was taught (prismatic joints in mm). If missing, the "
            "daemon chooses the arm configuration (elbow, wrist) nearest to the robot's joints at "
            "start-up, and the check warns; it also warns if the solution is more than 30 degrees "
            "from near_deg on any axis",
            "[-2.9, -97.1, -108.0, -64.9, 90.0, -92.9]"});
  keys.Choose("orientation", point.orientation_free, {{"fixed", false}, {"free", true}},
              {"\"free\": only the position matters"});
  keys.Add("payload_kg", point.payload_kg, kPayloadMass,
           {"payload at this point", "2.0", "the current payload"});
}

}  // namespace plumbline::config
