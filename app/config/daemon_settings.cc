#include "app/config/daemon_settings.h"

#include "app/config/limits.h"

namespace plumbline {
namespace {

constexpr double kBytesPerMB = 1e6;
constexpr NumberRange kPort{1, 65535}, kPortOrAny{0, 65535}, kId{1, 65535};
constexpr NumberRange kPayloadMass{0, kLargestPayload_kg};
constexpr NumberRange kCog{-20000, 20000, kMetrePerMm};

/// @tparam Line  SerialLine, or the slave's options
template <typename Line>
void ListSerialKeys(Settings& keys, Line& line, bool required, int fastest_baud,
                    const Meaning& device) {
  Meaning needed = device;
  needed.required = required;
  keys.Add("device", line.device, needed);
  keys.Add("baud", line.baud, {1200, static_cast<double>(fastest_baud)},
           {"one of the usual rates, in bit/s"});
  keys.Choose("parity", line.parity, {{"N", 'N'}, {"E", 'E'}, {"O", 'O'}}, {"none, even or odd"});
  keys.Add("stop_bits", line.stop_bits, {1, 2}, {});
}

void ListDiagnosisKeys(Settings& keys, LoopConfig& loop) {
  using Apply = LoopConfig::Apply;
  keys.Add("diagnose", loop.diagnose,
           {"after an alarm, at low priority: which effect does the model lack?"});
  keys.Add("probes_before_diagnosis", loop.probes_before_diagnosis, {0, 10000},
           {"since the change began"});
  keys.Add("diagnosis_timeout_s", loop.diagnosis_timeout_s, {1, 86400}, {});
  keys.Choose("apply", loop.apply, {{"ask", Apply::kAsk}, {"automatic", Apply::kAutomatic}},
              {"a better model is applied by a person with `plumbline model apply N`, or "
               "automatically if the diagnosis explains the residual by plausible, named effects, "
               "the held-out error falls, and neither a measured tip nor the command of a "
               "configured point moves by more than max_change_mm"});
  keys.Add("max_change_mm", loop.max_change_m, {0.001, 100, kMetrePerMm}, {"see apply"});
}

}  // namespace

void ListKeys(Settings& keys, DaemonConfig& config) {
  keys.Document(
      "cell", "text",
      FirstCell(1, "the arm and its tool; copy a ready cell and edit it", "\"cells/ur10.toml\""));
  keys.Path("state_directory", config.state_directory,
            {"boot counter, journal, models, lenses; relative: beside this file"});
}

void ListKeys(Settings& keys, RobotLinkConfig& robot) {
  RobotConnection& connection = robot.connection;
  keys.Document(
      "profile", "text",
      FirstCell(2, "the controller's register map", "\"profiles/universal-robots.toml\""));
  keys.Choose("transport", robot.transport, {{"tcp", "tcp"}, {"rtu", "rtu"}, {"replay", "replay"}},
              {"Modbus TCP, Modbus on a serial line, or a recorded table that is played"});
  keys.Add("host", connection.tcp.host,
           FirstCell(3, "of \"tcp\": the controller's name or address", "\"192.168.0.2\"",
                     robot.transport == "tcp"));
  keys.Add("port", connection.tcp.port, kPort, {.otherwise = "the profile's"});
  keys.Add(
      "unit_id", connection.unit_id, {0, 255},
      {.sentence = "248..254 are reserved, 255 is for TCP only", .otherwise = "the profile's"});
  keys.Add("timeout_ms", connection.timeout_s, {5, 10000, kSecondPerMs}, {"of one request"});
  ListSerialKeys(keys, connection.serial, robot.transport == "rtu", 921600,
                 {"of \"rtu\", with the next three", "\"/dev/ttyUSB0\""});
  keys.Document("replay_file", "text",
                {"of \"replay\": the table whose q<i>_deg columns are played", "\"run.csv\""});
  keys.Add("replay_rows_per_s", connection.replay.rows_per_s, {0.001, 1000},
           {"a row far from the one before counts as a jump"});
  keys.Add("replay_loop", connection.replay.loop,
           {"false: holds the last row, as a robot at standstill"});
}

void ListKeys(Settings& keys, PlausibilityLimits& limits) {
  keys.Add("stale_after_ms", limits.stale_after_s, {10, 60000, kSecondPerMs},
           {"older input withdraws every corrected point"});
}

void ListKeys(Settings& keys, PayloadPolicy& payload) {
  using Source = PayloadPolicy::Source;
  keys.Choose("source", payload.source,
              {{"robot", Source::kRobot}, {"table", Source::kTable}, {"fixed", Source::kFixed}},
              FirstCell(4, "its registers, a table by its tool number, or always the same",
                        "\"fixed\"", false));
  keys.Add("mass_kg", payload.fixed.mass_kg, kPayloadMass,
           FirstCell(5, "of \"fixed\"", "2.0", payload.source == Source::kFixed));
  keys.Add("cog_mm", payload.fixed.cog_F, kCog,
           {"centre of gravity in the flange frame", "[0.0, 0.0, 60.0]",
            "the controller's or the cell's"});
}

void ListKeys(Settings& keys, PayloadPolicy::ToolLoad& tool) {
  keys.Add("number", tool.number, kPortOrAny, Required("that the controller reports", "1"));
  keys.Add("mass_kg", tool.mass_kg, kPayloadMass, Required("", "2.0"));
  keys.Add("cog_mm", tool.cog_F, kCog,
           {"in the flange frame", "[0.0, 0.0, 60.0]", "the controller's or the cell's"});
}

void ListKeys(Settings& keys, PlcConfig& plc) {
  keys.Add("listen", plc.tcp.address,
           FirstCell(6, "this computer's address in the PLC's network", "\"0.0.0.0\"", false));
  keys.Add("port", plc.tcp.port, kPortOrAny, {"0: any free one, which the log names"});
  keys.Add("unit_id", plc.tcp.unit_id, {1, 247}, {"answered beside 0, 1 and 255"});
  keys.Choose("word_order", plc.convention.little_word_first, {{"ABCD", false}, {"CDAB", true}},
              {"of 32-bit values: high or low word first"});
  keys.Choose("orientation", plc.convention.orientation,
              {{"rotation_vector", OrientationConvention::kRotationVector},
               {"roll_pitch_yaw", OrientationConvention::kRollPitchYaw},
               {"a_b_c", OrientationConvention::kAbc}},
              {"Rz(yaw) Ry(pitch) Rx(roll); Rz(A) Ry(B) Rx(C)"});
  keys.Add("max_clients", plc.tcp.max_clients, {1, 256}, {"connected at the same time"});
  keys.Add("allow", plc.tcp.allow, {"client addresses", "[\"192.168.0.10\"]", "every client"});
}

void ListKeys(Settings& keys, modbus::RtuSlaveOptions& line) {
  ListSerialKeys(keys, line, true, 115200, {"its path", "\"/dev/ttyUSB1\""});
}

void ListKeys(Settings& keys, CorrectionLimits& limits) {
  keys.Add("max_translation_mm", limits.max_translation_m, {0.01, 1000, kMetrePerMm},
           {"also: a probe farther off (and 10 mrad) is quarantined"});
  keys.Add("max_rotation_deg", limits.max_rotation_rad, {0.001, 90, kRadPerDeg}, {});
  keys.Add("min_singular_value", limits.min_singular_value, {0, 1},
           {"of the tip's Jacobian; below it the arm is too near a singularity"});
  std::optional<double> share;
  keys.Add("deflection_sd", share, {0, 1},
           {"standard deviation of a declared deflection, as a share of it; if given, the radius "
            "of a fully declared cell counts as propagated, not as assumed",
            "0.1"});
  if (share) limits.deviation = {*share, true};
}

void ListKeys(Settings& keys, PushLimits& push, std::vector<int>& ids) {
  keys.Add("enabled", push.enabled, {"false: nothing is written"});
  keys.Add("point_ids", ids, kId, {"in the order of the profile's slots", "[1]"});
  keys.Add("max_step_mm", push.max_step_m, {0.001, 100, kMetrePerMm},
           {"from one write of a point to the next"});
  keys.Add("min_period_ms", push.min_period_s, {10, 60000, kSecondPerMs},
           {"between two writes of a point"});
}

void ListKeys(Settings& keys, LoopConfig& loop) {
  keys.Add("enabled", loop.enabled, {"true: the PLC's commands 6 and 7 are recorded"});
  keys.Add("session", loop.session,
           {"of measured.csv, written to every probe with a mark of the boot", "\"1\""});
  keys.Add("probe_sigma_mm", loop.probe_sigma_m, {0.001, 10, kMetrePerMm},
           {"scatter of one probe, one axis"});
  keys.Add("reference_probes", loop.reference_probes, {0, 100},
           {"5 or more: drift is a change against their mean, which is refused if they disagree; "
            "0: against the model itself"});
  keys.Add("reference_sd_mm", loop.reference_sd_m, {0, 10, kMetrePerMm},
           {"if reference_probes is 0: how far the model's mean residual may be from zero"});
  keys.Add("shift_mm", loop.shift_m, {0.001, 100, kMetrePerMm},
           {"the change to be detected quickly"});
  keys.Add("probes_per_day", loop.probes_per_day, {0.01, 86400},
           {"sets the alarm threshold, with the next"});
  keys.Add("false_alarms_per_year", loop.false_alarms_per_year, {0.001, 100}, {});
  ListDiagnosisKeys(keys, loop);
  keys.Add("journal_mb", loop.journal_bytes, {1, 1e6, kBytesPerMB},
           {"about 330 bytes a probe; when it is full probes are refused"});
}

void ListKeys(Settings& keys, PageConfig& page) {
  keys.Add("port", page.port, kPortOrAny, {"0: any free one; without it there is no page", "8080"});
  keys.Add("listen", page.listen, {"any other address needs a token"});
  keys.Add(
      "token", page.token,
      {"asked of whoever opens the page; 128 random bits", "\"what-openssl-rand-hex-16-prints\""});
  keys.Add("hosts", page.hosts,
           {"names by which browsers reach it, beside addresses and this computer's own",
            "[\"cell7.plant.example\"]"});
}

void ListKeys(Settings& keys, MqttConfig& mqtt) {
  keys.Add("host", mqtt.host, Required("its name or address", "\"broker.plant.lan\""));
  keys.Add("port", mqtt.port, kPort, {.otherwise = "1883; 8883 with tls_ca"});
  keys.Path("tls_ca", mqtt.tls_ca,
            {"certificates that the broker's is checked against; without it: no TLS",
             "\"plant-ca.pem\""});
  keys.Add("username", mqtt.username, {"with the next", "\"cell-7\""});
  keys.Path("password_file", mqtt.password_file,
            {"its first line; readable by the user plumbline alone", "\"mqtt-password\""});
  keys.Add("group", mqtt.group, {"of the topics: plumblineV1/GROUP/.../NODE"});
  keys.Add("node", mqtt.node, {"one of its own for each cell", "\"cell-7\"", "the arm's name"});
  keys.Add("client_id", mqtt.client_id, {"likewise", "\"cell-7\"", "plumbline-GROUP-NODE"});
  keys.Add("state_s", mqtt.state_period_s, {0.2, 3600}, {"from state to state if nothing changes"});
  keys.Add("change_s", mqtt.change_period_s, {0.2, 3600},
           {"shortest time between two messages of one thing that changes"});
  keys.Add("point_change_mm", mqtt.point_change_m, {0.001, 100, kMetrePerMm},
           {"a correction that moves less is not published"});
  keys.Add("queue_mb", mqtt.queue_bytes, {1, 100000, kBytesPerMB},
           {"kept on the disk while the broker is away"});
  keys.Add("journal", mqtt.journal, {"each probe, once"});
}

void ListCycleKeys(Settings& keys, double& period_s) {
  keys.Add("period_ms", period_s, {1, 1000, kSecondPerMs}, {"from one cycle to the next"});
}

void ListKeys(Settings& keys, FrameKeys& frame) {
  keys.Add("name", frame.name, FirstCell(0, "", "\"fixture\""));
  keys.Add("xyz_mm", frame.xyz_m, kPlaceRange,
           FirstCell(7, "its pose in the measurement frame", ""));
  keys.Add("rpy_deg", frame.rpy_rad, kTurnRange,
           FirstCell(0, "R = Rz(yaw) Ry(pitch) Rx(roll)", "", false));
}

void ListKeys(Settings& keys, PointKeys& placed) {
  AssemblyPoint& point = placed.point;
  keys.Add("id", point.id, kId, FirstCell(8, "the PLC asks for the point by this number", "1"));
  keys.Add("name", placed.name,
           {.example = "\"left bracket\"", .otherwise = "point ID", .active = true});
  keys.Add("frame", placed.frame, FirstCell(0, "", "\"fixture\"", false));
  keys.Add("xyz_mm", placed.xyz_m, kPlaceRange,
           FirstCell(9, "where the *loaded* tool point shall be", "[700.0, -200.0, 400.0]"));
  keys.Add("rpy_deg", placed.rpy_rad, kTurnRange,
           FirstCell(10, "and how it shall be oriented", "[180.0, 0.0, 0.0]", false));
  keys.Add("tool_point_mm", point.p_TP, {-5000, 5000, kMetrePerMm},
           {"in the tip frame, where the tool touches"});
  keys.Add("near_deg", placed.near, {-100000, 100000},
           {"the joints where the point was taught (prismatic ones in mm); without it the branch "
            "(elbow, wrist) is the one nearest to where the robot is when the daemon starts, and "
            "the check warns of it, as it does if the posture that reaches the point is more than "
            "30 degrees from near_deg on an axis",
            "[-2.9, -97.1, -108.0, -64.9, 90.0, -92.9]"});
  keys.Choose("orientation", point.orientation_free, {{"fixed", false}, {"free", true}},
              {"\"free\": only the position matters"});
  keys.Add("payload_kg", point.payload_kg, kPayloadMass,
           {"carried there", "2.0", "what the robot carries now"});
}

}  // namespace plumbline
