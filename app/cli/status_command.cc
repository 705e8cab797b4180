// plumbline status: prints the state of a running daemon, read from its Modbus registers.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <cstdint>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

#include "app/base/terminal/terminal_output.h"
#include "app/base/text/json_text.h"
#include "app/base/text/text.h"
#include "app/cell/view_link/view_client.h"
#include "app/cli/commands.h"
#include "app/cli/daemon_option.h"
#include "app/cli/daemon_registers.h"
#include "app/cli/failure.h"
#include "app/cli/number_option.h"
#include "app/cli/rounded.h"
#include "app/cli/status_devices.h"
#include "drivers/plc/codec.h"
#include "drivers/plc/register_map.h"
#include "firmware-like/correction/code_remedy.h"
#include "firmware-like/model/radius_coverage.h"
#include "firmware-like/result.h"

namespace plumbline::cli {
namespace {

// Output of `plumbline status` to be read: health, robot, model, devices and points.

/// "corrected by 2.84 mm, ±0.55 mm (95 %, assumed)".
std::string CorrectionText(double correction_mm, double radius_mm, model::RadiusBasis basis) {
  const int decimals = text::DecimalsFor({radius_mm}, 0);
  return fmt::format("corrected by {:.{}f} mm, ±{:.{}f} mm ({})", correction_mm, decimals,
                     radius_mm, decimals, model::CoverageText(basis));
}

/// "moving, 3.2 m/s2 at the tip: 0.84 mm ±0.12 mm (95 %, readings), 70 ms ago".
std::string MotionText(const DaemonRegisters& daemon) {
  const auto state = static_cast<motion::MotionState>(daemon.Word("motion_state"));
  if (state != motion::MotionState::kMoving) return motion::Describe(state);
  const Vec3 tip_mm(daemon.Value("dynamic_x"), daemon.Value("dynamic_y"),
                    daemon.Value("dynamic_z"));
  const double radius_mm = daemon.Value("dynamic_radius");
  const int decimals = text::DecimalsFor({radius_mm}, 0);
  return fmt::format(
      "moving, {:.1f} m/s2 at the tip: {:.{}f} mm ±{:.{}f} mm (95 %, readings), {} ms ago",
      daemon.Value("tip_acceleration"), tip_mm.norm(), decimals, radius_mm, decimals,
      daemon.Word("motion_age"));
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
std::string ProbeIntakeText(const DaemonRegisters& daemon,
                            const status::MonitoringStatus& monitoring) {
  std::vector<std::string> parts;
  if (const double refused = daemon.Value("probes_refused"); refused > 0) {
    parts.push_back(fmt::format("{:.0f} refused", refused));
  }
  if (const double quarantined = daemon.Value("probes_quarantined"); quarantined > 0) {
    parts.push_back(
        fmt::format("{:.0f} in quarantine: plumbline journal quarantine list", quarantined));
  }
  if (monitoring.radius_contradicted) {
    parts.emplace_back(
        "they contradict the stated radius, whose 95 % are withdrawn: see the log and the "
        "diagnosis");
  }
  if (monitoring.reference_refused) {
    parts.emplace_back(
        "reference refused because its probes disagree: see the log, then send command 8");
  }
  return fmt::format("{}", fmt::join(parts, "; "));
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

void PrintHealth(const DaemonRegisters& daemon, std::ostream& out) {
  const auto reason = static_cast<HealthReason>(daemon.Word("health_reason"));
  const auto severity = static_cast<HealthSeverity>(daemon.Word("health"));
  const terminal::Tone tone = severity == HealthSeverity::kAlarm ? terminal::Tone::kFault
                              : reason == HealthReason::kNone    ? terminal::Tone::kGood
                                                                 : terminal::Tone::kWarning;
  const std::string health =
      terminal::Painted(Describe(severity), tone, terminal::ShowsColours(out));
  PrintStatusLine(out, "health",
                  reason == HealthReason::kNone
                      ? health
                      : fmt::format("{}: {}; {}", health, Describe(reason), RemedyOf(reason)));
}

void PrintDaemon(const DaemonRegisters& daemon, std::ostream& out) {
  const int firmware = daemon.Word("firmware");
  PrintStatusLine(
      out, "daemon",
      fmt::format("version {}.{}.{}, up {:.0f} s, boot number {}, {} Modbus clients",
                  firmware / 10000, firmware / 100 % 100, firmware % 100, daemon.Value("uptime"),
                  daemon.Word("boot_counter"), daemon.Word("clients")));
  PrintStatusLine(out, "cycle",
                  fmt::format("{:.1f} ms, longest computation {:.2f} ms, {} late",
                              0.1 * daemon.Value("cycle_period"),
                              1e-3 * daemon.Value("longest_cycle"), daemon.Word("overruns")));
}

/// Names the reported number that the cell does not declare; empty if that is not the reason.
std::string UndeclaredText(const DaemonRegisters& daemon) {
  const int kind = daemon.Word("undeclared");
  if (kind == 0) return "";
  constexpr int kNone = 65535;
  const int number = daemon.Word("undeclared_number");
  const bool tool = kind == static_cast<int>(UndeclaredNumber::Kind::kTool);
  const char* const name = tool ? "tool" : "payload item";
  if (number == kNone) return fmt::format(": the controller reports no {} number", name);
  return fmt::format(": the cell declares no {} {}; correct the number, or add a {}", name, number,
                     tool ? "[[tool]]" : "[[payload.item]]");
}

/// State of the robot as the controller reports it: trust, joints, motion and payload.
void PrintRobot(const DaemonRegisters& daemon, std::ostream& out) {
  const auto fault = static_cast<InputFault>(daemon.Word("input_fault"));
  const int age_ms = daemon.Word("data_age");
  PrintStatusLine(out, "robot",
                  fault == InputFault::kOk ? fmt::format("trusted, {} ms old", age_ms)
                                           : fmt::format("NOT trusted: {}", Describe(fault)));
  std::string joints;
  const int known = fault == InputFault::kMissing ? 0 : daemon.Word("joints");
  for (int k = 1; k <= known; ++k) {
    joints += fmt::format(" {:.3f}", WithoutNegativeZero(daemon.Value(fmt::format("q{}", k)), 3));
  }
  PrintStatusLine(out, "joints", joints.empty() ? "none" : joints.substr(1) + " deg");
  if (const double radius_mm = daemon.Value("reading_radius"); radius_mm > 0) {
    PrintStatusLine(out, "",
                    fmt::format("resolution of the joint registers: ±{:.{}f} mm at the tip (95 %)",
                                radius_mm, text::DecimalsFor({radius_mm}, 0)));
  }
  if (fault == InputFault::kOk) PrintStatusLine(out, "motion", MotionText(daemon));
  PrintStatusLine(out, "payload",
                  daemon.Status(status::kPayloadValid)
                      ? fmt::format("{:.2f} kg", daemon.Value("payload"))
                      : "unknown" + UndeclaredText(daemon));
}

/// The model in force and the probes that check it.
void PrintModel(const DaemonRegisters& daemon, std::ostream& out) {
  const status::MonitoringStatus monitoring = plc::registers::MonitoringFlagsFromWord(
      static_cast<std::uint16_t>(daemon.Word("loop_state")));
  PrintStatusLine(out, "model", ModelText(daemon));
  if (monitoring.recording) {
    const std::string drift = monitoring.reference_refused ? "drift not monitored"
                              : monitoring.learning ? "learning the drift monitor's reference"
                                                    : fmt::format("drift {:.2f} of the threshold",
                                                                  daemon.Value("drift_statistic"));
    const double probes = daemon.Value("probes"), statistic = daemon.Value("drift_statistic");
    const bool none = probes == 0 && statistic == 0 && !monitoring.reference_refused;
    PrintStatusLine(
        out, "probes",
        fmt::format("{} since the start{}{}{}", none ? "none" : fmt::format("{:.0f}", probes),
                    none ? "" : ", " + drift, monitoring.drift_alarm ? ", ALARM" : "",
                    monitoring.diagnosing ? ", diagnosis running" : ""));
  }
  if (const std::string taken = ProbeIntakeText(daemon, monitoring); !taken.empty())
    PrintStatusLine(out, "", taken);
}

void PrintPoint(const DaemonRegisters& daemon, int point, std::ostream& out) {
  const auto line = [&](std::string_view topic, std::string_view text) {
    PrintStatusLine(out, topic, text);
  };
  const auto value = [&](const char* name) { return daemon.Value(name, point); };
  const auto code = static_cast<correction::CorrectionCode>(value("point_code"));
  const int validity = static_cast<int>(value("point_validity"));
  if ((validity & plc::registers::kValid) == 0) {
    line("point", fmt::format("{:<5}  no correction: {} (code {}); {}", value("point_id"),
                              Describe(code), static_cast<int>(code), correction::RemedyOf(code)));
    return;
  }
  line("point", fmt::format("{:<5}  x {:.3f}, y {:.3f}, z {:.3f} mm", value("point_id"),
                            WithoutNegativeZero(value("point_x"), 3),
                            WithoutNegativeZero(value("point_y"), 3),
                            WithoutNegativeZero(value("point_z"), 3)));
  line("", fmt::format("{:<5}  {}", "",
                       CorrectionText(value("point_correction"), value("point_uncertainty"),
                                      plc::registers::BasisOf(validity))));
  if (daemon.has_postures()) line("", fmt::format("{:<5}  {}", "", PostureText(daemon, point)));
}

/// One topic per line, in colours if the stream shows them.
void PrintStatus(const DaemonRegisters& daemon, std::ostream& out) {
  PrintHealth(daemon, out);
  PrintDaemon(daemon, out);
  PrintRobot(daemon, out);
  PrintModel(daemon, out);
  for (int k = 0; k < daemon.cameras(); ++k) PrintCamera(daemon, k, out);
  PrintObjects(daemon, out);
  PrintMotionLink(daemon, out);
  for (int k = 0; k < daemon.gauges(); ++k) PrintGauge(daemon, k, out);
  PrintStatusLine(out, "alarms", BitsText(daemon.Word("alarms"), plc::registers::AlarmBits()));
  PrintStatusLine(out, "warnings",
                  BitsText(daemon.Word("warnings"), plc::registers::WarningBits()));
  for (int k = 0; k < daemon.points(); ++k) PrintPoint(daemon, k, out);
}

// JSON output of `plumbline status`: the registers by their names in the register map.

nlohmann::json JsonOf(plc::FieldType type, double value) {
  if (type == plc::FieldType::kFloat) return value;
  return static_cast<std::int64_t>(value);
}

nlohmann::json CameraJson(const DaemonRegisters& daemon, int camera) {
  nlohmann::json json = {{"name", daemon.CameraName(camera)}};
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

nlohmann::json GaugeJson(const DaemonRegisters& daemon, int gauge) {
  const bool any = daemon.HasGaugeReading(gauge);
  const auto state = static_cast<status::GaugeState>(daemon.Gauge("gauge_state", gauge));
  nlohmann::json json = {{"name", daemon.GaugeName(gauge)},
                         {"state", Describe(state)},
                         {"outcome", GaugeOutcomeText(daemon, gauge)}};
  for (const plc::MapField& field : plc::registers::GaugeFields()) {
    const std::string_view name = field.name;
    const bool of_reading = name == "gauge_reading" || name == "gauge_age";
    if (name.starts_with("gauge_name_") || (of_reading && !any)) continue;
    json[field.name] = JsonOf(field.type, daemon.Gauge(name, gauge));
  }
  return json;
}

nlohmann::json PointJson(const DaemonRegisters& daemon, int point) {
  nlohmann::json json;
  for (const plc::MapField& field : plc::registers::PointFields()) {
    json[field.name] = JsonOf(field.type, daemon.Value(field.name, point));
  }
  if (daemon.has_postures()) {
    for (const plc::MapField& field : plc::registers::PostureFields()) {
      json[field.name] = JsonOf(field.type, daemon.Posture(field.name, point));
    }
  }
  return json;
}

/// Values in the units of the register map. Cameras, gauges and points are arrays; a gauge that has
/// sent no reading has no gauge_reading and no gauge_age.
nlohmann::json StatusJson(const DaemonRegisters& daemon) {
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
  for (const plc::MapField& field : plc::registers::MotionLinkFields()) {
    json[field.name] = JsonOf(field.type, daemon.MotionLink(field.name));
  }
  json["gauges"] = nlohmann::json::array();
  for (int k = 0; k < daemon.gauges(); ++k) json["gauges"].push_back(GaugeJson(daemon, k));
  json["points_detail"] = nlohmann::json::array();
  for (int k = 0; k < daemon.points(); ++k) json["points_detail"].push_back(PointJson(daemon, k));
  return json;
}

struct StatusOptions {
  std::string host = "127.0.0.1";
  int port = 502;
  std::string state;  ///< state_directory; empty if it is not known
  bool json = false;
};

/// Prints why the robot cannot be read, which is too long for registers: from the daemon's state.
void PrintRobotProblem(const std::string& state_directory) {
  constexpr double kWait_s = 1;
  if (state_directory.empty()) return;
  cell::ViewClient client(cell::ViewSocketOf(state_directory));
  cell::View view;
  if (!client.Read(kWait_s, view) || view.state.robot_problem.empty()) return;
  PrintStatusLine(std::cout, "robot link", view.state.robot_problem);
  PrintStatusLine(std::cout, "", view.state.robot_remedy);
}

int Run(const StatusOptions& options) {
  const Result<DaemonRegisters> daemon = DaemonRegisters::Read(options.host, options.port);
  if (!daemon) {
    std::cerr << "plumbline status: " << daemon.error() << '\n';
    return kExitUsage;
  }
  if (options.json) {
    std::cout << text::JsonText(StatusJson(*daemon), 1) << '\n';
  } else {
    std::cout << terminal::ForReading;
    PrintStatus(*daemon, std::cout);
    PrintRobotProblem(options.state);
  }
  const bool alarm = static_cast<HealthSeverity>(daemon->Word("health")) == HealthSeverity::kAlarm;
  return alarm ? kExitFault : kExitOk;
}

}  // namespace

void AddStatusCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<StatusOptions>();
  CLI::App* command = app.add_subcommand("status", "Show the state of a running daemon");
  CLI::Option* host =
      command->add_option("--host", options->host, "Address of the daemon")->capture_default_str();
  CLI::Option* port = command->add_option("--port", options->port, "plc.port of the daemon")
                          ->capture_default_str()
                          ->check(WholeNumberWithin(1, 65535));
  command
      ->add_option_function<std::string>(
          "--config",
          [options](const std::string& path) {
            const DaemonPlace place = PlaceOfDaemon(path, "--port");
            options->host = place.host;
            options->port = place.port;
            options->state = place.state_directory;
          },
          kDaemonOptionText)
      ->excludes(host)
      ->excludes(port);
  command->add_flag("--json", options->json, "Print JSON");
  command->footer(
      "Reads the PLC registers over Modbus TCP; `plumbline registers` explains them.\n\n"
      "Examples:\n  plumbline status --config my-cell/plumbline.toml\n  plumbline status --port "
      "1502\n\n"
      "Exit codes: 0 no alarm, 1 the health of the cell is ALARM, 2 no daemon responds.");
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace plumbline::cli
