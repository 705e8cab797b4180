#include "app/cli/status_command.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>
#include <memory>
#include <string_view>
#include <vector>

#include "app/cli/daemon_registers.h"
#include "app/cli/exit_codes.h"
#include "app/cli/number_option.h"
#include "app/cli/rounded.h"
#include "app/cli/terminal.h"
#include "app/cli/terminal_output.h"
#include "app/printed_digits.h"
#include "app/text/json_text.h"
#include "drivers/plc/codec.h"
#include "firmware-like/result.h"

namespace plumbline::cli {
namespace {

struct StatusOptions {
  std::string host = "127.0.0.1";
  int port = 502;
  bool json = false;
};

std::string NameOfCamera(const DaemonRegisters& daemon, int camera) {
  const auto name = static_cast<std::size_t>(daemon.Camera("camera_name", camera));
  return name < status::kCameraNames.size() ? status::kCameraNames[name] : "";
}

nlohmann::json JsonOf(plc::FieldType type, double value) {
  if (type == plc::FieldType::kFloat) return value;
  return static_cast<std::int64_t>(value);
}

nlohmann::json CameraJson(const DaemonRegisters& daemon, int camera) {
  nlohmann::json json = {{"name", NameOfCamera(daemon, camera)}};
  for (const plc::MapField& field : plc::registers::CameraFields()) {
    json[field.name] = JsonOf(field.type, daemon.Camera(field.name, camera));
  }
  json["bodies_detail"] = nlohmann::json::array();
  for (int k = 0; k < static_cast<int>(daemon.Camera("bodies", camera)); ++k) {
    nlohmann::json body;
    for (const plc::MapField& field : plc::registers::BodyFields()) {
      body[field.name] = JsonOf(field.type, daemon.Body(field.name, camera, k));
    }
    json["bodies_detail"].push_back(body);
  }
  return json;
}

/// The name from its registers, two characters each.
std::string NameOfGauge(const DaemonRegisters& daemon, int gauge) {
  std::string name;
  for (const plc::MapField& field : plc::registers::GaugeFields()) {
    if (!std::string_view(field.name).starts_with("gauge_name_")) continue;
    const auto word = static_cast<unsigned>(daemon.Gauge(field.name, gauge));
    for (const unsigned code : {word >> 8U, word & 0xFFU}) {
      if (code != 0) name += static_cast<char>(code);
    }
  }
  return name;
}

constexpr double kNoReading_ms = 4294967295;  // gauge_age

nlohmann::json GaugeJson(const DaemonRegisters& daemon, int gauge) {
  const bool any = daemon.Gauge("gauge_age", gauge) < kNoReading_ms;
  const auto state = static_cast<status::GaugeState>(daemon.Gauge("gauge_state", gauge));
  nlohmann::json json = {{"name", NameOfGauge(daemon, gauge)}, {"state", Describe(state)}};
  for (const plc::MapField& field : plc::registers::GaugeFields()) {
    const std::string_view name = field.name;
    const bool of_reading = name == "gauge_reading" || name == "gauge_age";
    if (name.starts_with("gauge_name_") || (of_reading && !any)) continue;
    json[field.name] = JsonOf(field.type, daemon.Gauge(name, gauge));
  }
  return json;
}

nlohmann::json AsJson(const DaemonRegisters& daemon) {
  nlohmann::json json;
  for (const plc::MapField& field : plc::registers::Fields()) {
    const bool result =
        field.address >= plc::registers::kResult && field.address < plc::registers::kInputs;
    if (!result) json[field.name] = JsonOf(field.type, daemon.Value(field.name));
  }
  json["cameras"] = nlohmann::json::array();
  for (int k = 0; k < daemon.cameras(); ++k) json["cameras"].push_back(CameraJson(daemon, k));
  for (const plc::MapField& field : plc::registers::SceneFields()) {
    json[field.name] = JsonOf(field.type, daemon.Scene(field.name));
  }
  json["gauges"] = nlohmann::json::array();
  for (int k = 0; k < daemon.gauges(); ++k) json["gauges"].push_back(GaugeJson(daemon, k));
  json["points_detail"] = nlohmann::json::array();
  for (int k = 0; k < daemon.points(); ++k) {
    nlohmann::json point;
    for (const plc::MapField& field : plc::registers::PointFields()) {
      point[field.name] = JsonOf(field.type, daemon.Value(field.name, k));
    }
    if (daemon.has_postures()) {
      for (const plc::MapField& field : plc::registers::PostureFields()) {
        point[field.name] = JsonOf(field.type, daemon.Posture(field.name, k));
      }
    }
    json["points_detail"].push_back(point);
  }
  return json;
}

/// "none", or "0x0041: nothing read from the robot, a point has no correction".
std::string WordText(int word, std::span<const plc::BitMeaning> bits) {
  if (word == 0) return "none";
  std::string text = fmt::format("0x{:04X}:", word);
  const char* separator = " ";
  for (const plc::BitMeaning& bit : bits) {
    if ((word & bit.mask) == 0) continue;
    text += separator + std::string(bit.meaning);
    separator = ", ";
  }
  return text;
}

/// "corrected by 2.84 mm, ±0.55 mm (95 %, assumed)".
std::string CorrectionText(double correction_mm, double radius_mm, model::RadiusBasis basis) {
  const int decimals = DecimalsFor({radius_mm}, 0);
  return fmt::format("corrected by {:.{}f} mm, ±{:.{}f} mm (95 %, {})", correction_mm, decimals,
                     radius_mm, decimals, Describe(basis));
}

/// "x 1.23, y 4.56, z 7.89 mm, ±0.42 mm (95 %)": a measured position with the digits that its
/// radius leaves.
std::string PositionText(const Vec3& p_mm, double radius_mm) {
  const int decimals = DecimalsFor({radius_mm}, 0);
  return fmt::format("x {:.{}f}, y {:.{}f}, z {:.{}f} mm, ±{:.{}f} mm (95 %)",
                     WithoutNegativeZero(p_mm.x(), decimals), decimals,
                     WithoutNegativeZero(p_mm.y(), decimals), decimals,
                     WithoutNegativeZero(p_mm.z(), decimals), decimals, radius_mm, decimals);
}

/// "moving, tip at 3.2 m/s2: displaced by 0.84 mm, ±0.12 mm (95 %, readings only), 70 ms ago".
std::string MotionText(const DaemonRegisters& daemon) {
  const auto state = static_cast<motion::MotionState>(daemon.Word("motion_state"));
  if (state != motion::MotionState::kMoving) return motion::Describe(state);
  const Vec3 tip_mm(daemon.Value("dynamic_x"), daemon.Value("dynamic_y"),
                    daemon.Value("dynamic_z"));
  const double radius_mm = daemon.Value("dynamic_radius");
  const int decimals = DecimalsFor({radius_mm}, 0);
  return fmt::format(
      "moving, {:.1f} m/s2 at the tip: {:.{}f} mm ±{:.{}f} mm (95 %, readings), {} ms ago",
      daemon.Value("tip_acceleration"), tip_mm.norm(), decimals, radius_mm, decimals,
      daemon.Word("motion_age"));
}

std::string Age(double age_ms) {
  return age_ms >= 65535 ? "never or long ago" : fmt::format("{:.0f} ms ago", age_ms);
}

/// "version 2 in force, fitted to measured points, 1 effect; version 3 proposed".
std::string ModelText(const DaemonRegisters& daemon) {
  const int applied = daemon.Word("model_applied"), proposed = daemon.Word("model_proposed");
  const int effects = daemon.Word("model_effects");
  return fmt::format("{} in force, {}, {} effect{}{}",
                     applied > 0 ? fmt::format("version {}", applied) : "the cell file",
                     daemon.Word("model_fitted") != 0 ? "fitted to measured points" : "declared",
                     effects, effects == 1 ? "" : "s",
                     proposed > 0 ? fmt::format("; version {} proposed", proposed) : "");
}

/// Summary of the probes that were refused or quarantined; empty if there are none.
std::string ProbeIntakeText(const DaemonRegisters& daemon, bool reference_refused) {
  std::vector<std::string> parts;
  if (const double refused = daemon.Value("probes_refused"); refused > 0) {
    parts.push_back(fmt::format("{:.0f} refused", refused));
  }
  if (const double quarantined = daemon.Value("probes_quarantined"); quarantined > 0) {
    parts.push_back(
        fmt::format("{:.0f} in quarantine: plumbline journal quarantine list", quarantined));
  }
  if (reference_refused) {
    parts.emplace_back(
        "reference refused because its probes disagree: see the log, then send command 8");
  }
  return fmt::format("{}", fmt::join(parts, "; "));
}

void PrintCamera(const DaemonRegisters& daemon, int camera) {
  const auto line = [](const std::string& topic, const std::string& text) {
    std::cout << fmt::format("{:<12} {}\n", topic, text);
  };
  const auto value = [&](const char* name) { return daemon.Camera(name, camera); };
  const auto number = [&](const char* name) { return static_cast<int>(value(name)); };
  const int state = number("camera_state");
  const std::string called = NameOfCamera(daemon, camera);
  line(called.empty() ? "camera" : "camera " + called,
       fmt::format("{}: {}", lens::ZoomStateText(static_cast<lens::ZoomState>(state - 1)),
                   lens::ZoomReasonText(static_cast<lens::ZoomReason>(number("camera_reason")))));
  line("", fmt::format("zoom {}, read {}; last frame {}; {}", number("zoom"),
                       Age(value("zoom_age")), Age(value("camera_age")),
                       number("lens") > 0 ? fmt::format("lens {} of the store", number("lens"))
                                          : std::string("no stored lens")));
  const int usable_px = number("lens_usable_radius");
  if (usable_px > 0 && usable_px != plc::registers::kWholeImage) {
    line("", fmt::format("lens usable up to {} px from the middle of the image; nothing is "
                         "measured beyond",
                         usable_px));
  }
  if (const int bits = number("camera_bits"); bits != 0) {
    line("", WordText(bits, plc::registers::CameraBits()));
  }
  if (const int tags = number("contradicting_tags"); tags > 0) {
    line("", fmt::format("reference tag {}{} contradicts the others; the log names each",
                         number("contradicting_tag"),
                         tags > 1 ? fmt::format(" and {} more", tags - 1) : ""));
  }
  if (const int prompt = number("board_prompt"); prompt > 0) {
    line("board",
         fmt::format("{} ({} views)", lens::BoardPromptText(static_cast<lens::BoardPrompt>(prompt)),
                     number("board_views")));
  }
  for (int k = 0; k < number("bodies"); ++k) {
    const auto of_body = [&](const char* name) { return daemon.Body(name, camera, k); };
    const bool valid = (static_cast<int>(of_body("body_validity")) & plc::registers::kValid) != 0;
    line("body", fmt::format("{:<5}  {}", k + 1,
                             valid ? fmt::format("{}, seen {}",
                                                 PositionText({of_body("body_x"), of_body("body_y"),
                                                               of_body("body_z")},
                                                              of_body("body_radius")),
                                                 Age(of_body("body_age")))
                                   : std::string("not visible, or the lens is not valid")));
  }
  if ((number("tip_validity") & plc::registers::kValid) != 0) {
    line("tip", fmt::format("{}, measured by camera",
                            PositionText({value("tip_x"), value("tip_y"), value("tip_z")},
                                         value("tip_radius"))));
  }
}

/// "12 s", "5 min", "3.5 h".
std::string GaugeTimeText(double time_s) {
  if (time_s < 120) return fmt::format("{:.0f} s", time_s);
  return time_s < 7200 ? fmt::format("{:.0f} min", time_s / 60)
                       : fmt::format("{:.1f} h", time_s / 3600);
}

/// "gauge dial: connected, waiting for a press, for 5 min; 1.2345 mm, 12 s ago".
void PrintGauge(const DaemonRegisters& daemon, int gauge) {
  const auto state = static_cast<status::GaugeState>(daemon.Gauge("gauge_state", gauge));
  const double age_ms = daemon.Gauge("gauge_age", gauge);
  const std::string reading =
      age_ms < kNoReading_ms
          ? fmt::format("{:.4f} mm, {} ago",
                        WithoutNegativeZero(daemon.Gauge("gauge_reading", gauge), 4),
                        GaugeTimeText(1e-3 * age_ms))
          : "no reading yet";
  std::cout << fmt::format("{:<12} {}, for {}; {}\n", "gauge " + NameOfGauge(daemon, gauge),
                           Describe(state), GaugeTimeText(daemon.Gauge("gauge_state_age", gauge)),
                           reading);
}

void PrintScene(const DaemonRegisters& daemon) {
  const auto number = [&](const char* name) { return static_cast<int>(daemon.Scene(name)); };
  if (number("scene_age") >= 65535) return;
  std::string text = number("scene_state") == 2   ? "INTERFERENCE"
                     : number("scene_state") == 1 ? "apart"
                                                  : "unknown";
  if (number("scene_object_a") > 0) {
    text += fmt::format(", nearest: {} and {}, {:.2f} mm", number("scene_object_a"),
                        number("scene_object_b"), daemon.Scene("scene_distance"));
  }
  if (const int pairs = number("scene_unmeasured"); pairs > 0) {
    text += fmt::format(", {} pairs not measured", pairs);
  }
  std::cout << fmt::format("{:<12} {}\n", "objects", text);
}

/// The second line of a point: "posture 12.0 -90.0 90.0 ... deg, 85.0 from the limit of q2".
std::string PostureText(const DaemonRegisters& daemon, int point) {
  std::string text = "posture";
  for (int k = 1; k <= daemon.Word("joints"); ++k) {
    text += fmt::format(
        " {:.1f}", WithoutNegativeZero(daemon.Posture(fmt::format("posture_q{}", k), point), 1));
  }
  text += " deg";
  if (const int joint = static_cast<int>(daemon.Posture("posture_limit_joint", point)); joint > 0) {
    text += fmt::format(", {:.1f} from the limit of q{}",
                        daemon.Posture("posture_limit_distance", point), joint);
  }
  const int bits = static_cast<int>(daemon.Posture("posture_validity", point));
  if ((bits & plc::registers::kPostureDiffers) != 0) text += ", NOT near near_deg";
  if ((bits & plc::registers::kPostureTaught) == 0) text += ", chosen without near_deg";
  return text;
}

void Print(const DaemonRegisters& daemon) {
  const auto line = [](const char* topic, const std::string& text) {
    std::cout << fmt::format("{:<12} {}\n", topic, text);
  };
  const auto reason = static_cast<HealthReason>(daemon.Word("health_reason"));
  const auto severity = static_cast<HealthSeverity>(daemon.Word("health"));
  const Tone tone = severity == HealthSeverity::kAlarm ? Tone::kFault
                    : reason == HealthReason::kNone    ? Tone::kGood
                                                       : Tone::kWarning;
  const std::string health = Painted(Describe(severity), tone, ShowsColours(std::cout));
  line("health", reason == HealthReason::kNone
                     ? health
                     : fmt::format("{}: {}; {}", health, Describe(reason), RemedyOf(reason)));
  const int firmware = daemon.Word("firmware");
  line("daemon",
       fmt::format("version {}.{}.{}, up {:.0f} s, boot number {}, {} Modbus clients",
                   firmware / 10000, firmware / 100 % 100, firmware % 100, daemon.Value("uptime"),
                   daemon.Word("boot_counter"), daemon.Word("clients")));
  line("cycle", fmt::format("{:.1f} ms, longest computation {:.2f} ms, {} late",
                            0.1 * daemon.Value("cycle_period"),
                            1e-3 * daemon.Value("longest_cycle"), daemon.Word("overruns")));
  const auto fault = static_cast<InputFault>(daemon.Word("input_fault"));
  const int age_ms = daemon.Word("data_age");
  line("robot", fault == InputFault::kOk ? fmt::format("trusted, {} ms old", age_ms)
                                         : fmt::format("NOT trusted: {}", Describe(fault)));
  std::string joints;
  const int known = fault == InputFault::kMissing ? 0 : daemon.Word("joints");
  for (int k = 1; k <= known; ++k) {
    joints += fmt::format(" {:.3f}", WithoutNegativeZero(daemon.Value(fmt::format("q{}", k)), 3));
  }
  line("joints", joints.empty() ? "none" : joints.substr(1) + " deg");
  if (const double radius_mm = daemon.Value("reading_radius"); radius_mm > 0) {
    line("", fmt::format("resolution of the joint registers: ±{:.{}f} mm at the tip (95 %)",
                         radius_mm, DecimalsFor({radius_mm}, 0)));
  }
  if (fault == InputFault::kOk) line("motion", MotionText(daemon));
  line("payload", daemon.Status(status::kPayloadValid)
                      ? fmt::format("{:.2f} kg", daemon.Value("payload"))
                      : "unknown");
  const status::MonitoringStatus monitoring = plc::registers::MonitoringFlagsFromWord(
      static_cast<std::uint16_t>(daemon.Word("loop_state")));
  line("model", ModelText(daemon));
  if (monitoring.recording) {
    const std::string drift =
        monitoring.reference_refused
            ? "drift not monitored"
            : fmt::format("drift {:.2f} of the threshold", daemon.Value("drift_statistic"));
    line("probes", fmt::format("{:.0f} since the start, {}{}{}", daemon.Value("probes"), drift,
                               monitoring.drift_alarm ? ", ALARM" : "",
                               monitoring.diagnosing ? ", diagnosis running" : ""));
  }
  if (const std::string taken = ProbeIntakeText(daemon, monitoring.reference_refused);
      !taken.empty())
    line("", taken);
  for (int k = 0; k < daemon.cameras(); ++k) PrintCamera(daemon, k);
  PrintScene(daemon);
  for (int k = 0; k < daemon.gauges(); ++k) PrintGauge(daemon, k);
  line("alarms", WordText(daemon.Word("alarms"), plc::registers::AlarmBits()));
  line("warnings", WordText(daemon.Word("warnings"), plc::registers::WarningBits()));
  for (int k = 0; k < daemon.points(); ++k) {
    const auto value = [&](const char* name) { return daemon.Value(name, k); };
    const auto code = static_cast<correction::CorrectionCode>(value("point_code"));
    const int validity = static_cast<int>(value("point_validity"));
    const bool valid = (validity & plc::registers::kValid) != 0;
    if (!valid) {
      line("point", fmt::format("{:<5}  no correction: {}", value("point_id"), Describe(code)));
      continue;
    }
    line("point", fmt::format("{:<5}  x {:.3f}, y {:.3f}, z {:.3f} mm", value("point_id"),
                              WithoutNegativeZero(value("point_x"), 3),
                              WithoutNegativeZero(value("point_y"), 3),
                              WithoutNegativeZero(value("point_z"), 3)));
    line("", fmt::format("{:<5}  {}", "",
                         CorrectionText(value("point_correction"), value("point_uncertainty"),
                                        plc::registers::BasisOf(validity))));
    if (daemon.has_postures()) line("", fmt::format("{:<5}  {}", "", PostureText(daemon, k)));
  }
}

int Run(const StatusOptions& options) {
  const Result<DaemonRegisters> daemon = DaemonRegisters::Read(options.host, options.port);
  if (!daemon) {
    std::cerr << "plumbline status: " << daemon.error() << '\n';
    return kExitUsage;
  }
  if (options.json) {
    std::cout << text::JsonText(AsJson(*daemon), 1) << '\n';
  } else {
    std::cout << ForReading;
    Print(*daemon);
  }
  const bool alarm = static_cast<HealthSeverity>(daemon->Word("health")) == HealthSeverity::kAlarm;
  return alarm ? kExitFault : kExitOk;
}

}  // namespace

void AddStatusCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<StatusOptions>();
  CLI::App* command = app.add_subcommand("status", "Show the state of a running daemon");
  command->add_option("--host", options->host, "Address of the daemon")->capture_default_str();
  command->add_option("--port", options->port, "plc.port of the daemon")
      ->capture_default_str()
      ->check(WholeNumberWithin(1, 65535));
  command->add_flag("--json", options->json, "Print JSON");
  command->footer(
      "Reads the PLC registers over Modbus TCP; `plumbline registers` explains them.\n\n"
      "Example:\n  plumbline status --port 1502\n\n"
      "Exit codes: 0 no alarm, 1 the health of the cell is ALARM, 2 no daemon responds.");
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace plumbline::cli
