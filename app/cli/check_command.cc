// plumbline check: reports every fault of a cell or configuration file, and a summary of the cell.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <iostream>
#include <memory>

#include "app/base/config/carried_numbers.h"
#include "app/base/config/cell_reader.h"
#include "app/base/config/daemon_config_reader.h"
#include "app/base/config/fault.h"
#include "app/base/config/required_file.h"
#include "app/base/recognition/recognition.h"
#include "app/base/terminal/terminal_output.h"
#include "app/base/text/json_text.h"
#include "app/cell/model_store/usable_model.h"
#include "app/cell/scene/object_table.h"
#include "app/cli/commands.h"
#include "app/cli/failure.h"
#include "app/cli/point_table.h"
#include "app/cli/progress.h"
#include "app/measure/table/replay_file.h"
#include "drivers/files/open_failure.h"
#include "drivers/files/text_file.h"
#include "firmware-like/kinematics/chain.h"
#include "firmware-like/model/joint_columns.h"

namespace plumbline::cli {
namespace {

struct CheckOptions {
  std::string file;
  bool json = false;
};

/// Result of checking a file.
struct CheckedFile {
  bool is_configuration = false;
  config::FaultList faults;
  std::optional<model::CellModel> cell;
  std::optional<config::DaemonConfig> config;
  /// For a configuration: the machine with the model in force, and its solutions of the points.
  MachineConfig in_force;
  std::vector<config::PointSolution> points;
  bool model_applied = false;  ///< an applied model replaces the cell file
};

std::string MmText(const Vec3& p) {
  return fmt::format("({:.6g}, {:.6g}, {:.6g}) mm", 1e3 * p.x(), 1e3 * p.y(), 1e3 * p.z());
}

std::string ToolText(const model::Tool& tool) {
  if (tool.rigid) return "rigid, tip at " + MmText(tool.tcp_F) + " in the flange frame";
  double mass_kg = 0;
  for (const model::ToolSegment& segment : tool.segments) {
    mass_kg += segment.material.density_kg_m3 * segment.section.area_m2 * segment.length_m;
  }
  return fmt::format(
      "{} beam of {} segment{}, {:.6g} mm, {:.4g} kg, mount {:.4g} kg",
      tool.theory == model::BeamTheory::kTimoshenko ? "Timoshenko" : "Euler-Bernoulli",
      tool.segments.size(), tool.segments.size() == 1 ? "" : "s", 1e3 * tool.Length(), mass_kg,
      tool.mount_mass_kg);
}

/// "all", "none", or the joints that have it: "q1, q3".
std::string JointsWith(const model::Robot& robot, bool (*has)(const model::Joint&)) {
  std::string names;
  int count = 0;
  for (int i = 0; i < robot.size(); ++i) {
    if (!has(robot.joints[static_cast<std::size_t>(i)])) continue;
    names += fmt::format("{}q{}", names.empty() ? "" : ", ", i + 1);
    ++count;
  }
  if (count == robot.size()) return "all";
  return count == 0 ? "none" : names;
}

std::string MassText(const model::Robot& robot) {
  double mass_kg = 0;
  for (const model::Joint& joint : robot.joints) mass_kg += joint.link_mass_kg.value_or(0);
  const std::string known =
      JointsWith(robot, [](const model::Joint& joint) { return joint.link_mass_kg.has_value(); });
  if (known == "none") return "no link masses declared: joint torques are unknown";
  return fmt::format(
      "link masses declared: {} ({:.4g} kg), centres of mass: {}", known, mass_kg,
      JointsWith(robot, [](const model::Joint& joint) { return joint.link_com_m.has_value(); }));
}

std::string MeasurementText(const model::Measurement& measurement) {
  const char* kind = measurement.kind == model::MeasurementKind::kPosition ? "position of the tip"
                     : measurement.kind == model::MeasurementKind::kRange  ? "range from an anchor"
                                                                           : "pose of the tip";
  const std::string sigma =
      measurement.sigma_m
          ? fmt::format("standard deviation {:.4g} mm per axis", 1e3 * *measurement.sigma_m)
          : "standard deviation unknown";
  return fmt::format("{}; instrument {}, tip {}, {}", kind,
                     measurement.frame_known ? "aligned" : "unaligned",
                     measurement.tool_known ? "known" : "to be estimated", sigma);
}

std::string ControllerText(const config::RobotLinkConfig& robot) {
  const robot::RobotConnection& link = robot.connection;
  if (robot.transport == "rtde") {
    return fmt::format("rtde {}:{}, {:g} packages a second", link.tcp.host, link.tcp.port,
                       link.rtde.frequency_hz);
  }
  const std::string where = robot.transport == "tcp"
                                ? fmt::format("tcp {}:{}", link.tcp.host, link.tcp.port)
                            : robot.transport == "rtu" ? "rtu " + link.serial.device
                                                       : "replay of " + robot.replay_file;
  return fmt::format("{}, unit id {}, profile {}", where, link.unit_id, link.profile.name);
}

/// "A1, zoom by visca".
std::string CameraText(const config::CameraConfig& camera) {
  const camera::CameraConnection& link = camera.connection;
  const zoom::ZoomKind* const kind = zoom::FindZoomKind(camera.zoom.kind);
  std::string zoom = kind == nullptr ? "no zoom" : "zoom by " + camera.zoom.kind;
  if (kind != nullptr && kind->in_network != nullptr && kind->in_network(camera.zoom.connection)) {
    zoom += " at " + kind->identity(camera.zoom.connection);
  }
  return fmt::format(
      "{}, {}",
      camera.kind == "recorded" ? "recording " + link.recorded.path : "device " + link.v4l2.device,
      zoom);
}

/// Checks the object table of the configuration and whether its mesh files are readable.
/// @return  false if the table has faults
bool CheckObjects(const config::DaemonConfig& config, config::FaultList& faults) {
  const std::string& file = config.overlay.objects_file;
  if (file.empty()) return true;
  const auto text = config::ReadRequiredFile(file, faults);
  if (!text) return false;
  const target::TagDatabase* const tags =
      !config.vision.cameras.empty() ? &config.vision.tags.database : nullptr;
  const auto table = cell::ObjectTableFromText(*text, file, tags, faults);
  if (!table) return false;
  for (const cell::SceneObject& object : table->objects) {
    if (access(object.file.c_str(), R_OK) == 0) continue;
    faults.Add({config::Fault::Severity::kWarning, file, 0, "object.file",
                fmt::format("{} of \"{}\" {}", object.file, object.name,
                            files::ReadErrorText(object.file, std::strerror(errno)))});
  }
  return true;
}

CheckedFile Check(const std::string& text, const std::string& file) {
  CheckedFile checked;
  checked.is_configuration =
      recognition::Recognise(text, file).content == recognition::Content::kConfiguration;
  if (checked.is_configuration) {
    checked.config = config::DaemonConfigFromText(text, file, checked.faults);
    const bool replay = checked.config && checked.config->robot.transport == "replay";
    if (replay && !measure::ReadReplayFile(*checked.config, checked.faults)) checked.config.reset();
    if (checked.config) {
      if (const auto why_not = cell::ModelUnusableReason(checked.config->machine.cell)) {
        checked.faults.Add(
            {config::Fault::Severity::kFault, checked.config->cell_file, 0, "effect", *why_not});
        checked.config.reset();
      }
    }
    if (checked.config) {
      config::FaultList applied;
      checked.in_force = checked.config->machine;
      if (auto model = cell::CheckModelStore(checked.config->state_directory,
                                             checked.config->cell_file, applied)) {
        checked.in_force.cell = deflection::CellOfPoints(*model);
        checked.model_applied = true;
      }
      checked.faults.Append(applied);
      if (applied.HasFaults()) checked.config.reset();
    }
    if (checked.config && !CheckObjects(*checked.config, checked.faults)) checked.config.reset();
    if (checked.config) {
      checked.cell = checked.config->machine.cell;
      Progress progress(std::cerr, false);
      checked.points = config::SolvePoints(checked.in_force, [&](std::size_t done) {
        progress.ShowCount(done, checked.in_force.points.size(), "points");
      });
      const std::string nothing = config::NothingCorrectedText(checked.in_force, checked.points);
      if (!nothing.empty())
        checked.faults.Add({config::Fault::Severity::kWarning, file, 0, "point", nothing});
    }
  } else {
    checked.cell = config::CellFromText(text, file, checked.faults);
    if (const auto why_not =
            checked.cell ? cell::ModelUnusableReason(*checked.cell) : std::nullopt) {
      checked.faults.Add({config::Fault::Severity::kWarning, file, 0, "effect",
                          "the daemon refuses this model: " + *why_not});
    }
  }
  return checked;
}

/// "centre of gravity (0, 0, 0) mm in the flange frame, 600 mm from the tool's tip".
std::string CogText(const model::CellModel& cell, const Vec3& cog_F) {
  return fmt::format("centre of gravity {} in the flange frame, {:.6g} mm from the tool's tip",
                     MmText(cog_F), 1e3 * (cell.tool.tcp_F - cog_F).norm());
}

std::string CogText(const model::CellModel& cell) {
  return cell.payload_cog_F ? CogText(cell, *cell.payload_cog_F)
                            : "centre of gravity unknown: payload masses cannot be used";
}

std::string DomainText(const model::CellModel& cell) {
  const std::optional<model::Domain>& domain = cell.domain;
  if (!domain) return "none: the model is used within the joint limits";
  if (!domain->distant_sigma_m || !domain->residual_sigma_m) return "declared";
  const double near_mm = *domain->residual_sigma_m / kMetrePerMm;
  const double growth_m = domain->declared_sigma_m.value_or(*domain->distant_sigma_m);
  const std::string text = fmt::format(
      "declared; standard deviation per axis {:.3g} mm at the measured poses and {:.3g} mm {}",
      near_mm, std::hypot(*domain->residual_sigma_m, growth_m) / kMetrePerMm,
      domain->declared_sigma_m ? "far from them" : "at a distance of one radian from them");
  if (!domain->declared_sigma_m || cell.effects.empty()) return text;
  return text + fmt::format(
                    "; the causes of the correction are not confirmed: {:.0f} % of it is applied "
                    "at the measured poses, and less far from them",
                    100 * domain->applied_share);
}

/// The payload mass, which only the configuration contains, and its centre of gravity.
std::string PayloadText(const config::DaemonConfig& config) {
  const model::CellModel& cell = config.machine.cell;
  const PayloadPolicy& payload = config.machine.payload;
  if (payload.source == PayloadPolicy::Source::kFixed) {
    const auto& cog_F = payload.fixed.cog_F;
    return fmt::format("{:.6g} kg, {}", payload.fixed.mass_kg,
                       cog_F ? CogText(cell, *cog_F) : CogText(cell));
  }
  const bool by_tool = payload.source == PayloadPolicy::Source::kTable;
  return fmt::format("mass {}; {} unless given there",
                     by_tool ? fmt::format("by tool number ({} tools)", payload.table.size())
                             : std::string("reported by the robot"),
                     CogText(cell));
}

/// One line of the summary.
struct SummaryLine {
  std::string topic, text;
};

/// Summary of a cell in the units of its file: arm, tool, masses, compliance, payload, measurement,
/// effects. States explicitly what is not declared.
std::vector<SummaryLine> CellSummary(const model::CellModel& cell) {
  const model::Robot& robot = cell.robot;
  std::vector<SummaryLine> lines = {
      {"robot", fmt::format("{}, {} joints, flange at most {:.4g} m from the base", robot.name,
                            robot.size(), kinematics::Chain(robot).Reach())},
  };
  for (const model::JointCoupling& coupling : robot.couplings) {
    lines.push_back(
        {"coupling",
         fmt::format("q{} also turns with q{}, ratio {:.6g}; deflections act on {}",
                     coupling.joint + 1, coupling.of + 1,
                     coupling.ratio / model::CouplingRatioToSI(robot, coupling),
                     coupling.drive == model::CouplingDrive::kAxis ? "the axis" : "the readings")});
  }
  const std::string orientation =
      config::OrientationText(correction::Corrector(cell, {}).orientation());
  if (!orientation.empty()) lines.push_back({"orientation", orientation});
  for (int k = 0; k < cell.tools(); ++k) {
    const model::Tool& tool = cell.ToolAt(k);
    lines.push_back({tool.number ? fmt::format("tool {}", *tool.number) : "tool", ToolText(tool)});
  }
  lines.push_back({"masses", MassText(robot)});
  const std::string compliant = JointsWith(
      robot, [](const model::Joint& joint) { return joint.compliance_rad_per_Nm.value_or(0) > 0; });
  lines.push_back({"compliance", compliant == "none" ? "none declared: joints are assumed rigid"
                                                     : "declared: " + compliant});
  lines.push_back({"payload", CogText(cell)});
  for (const model::PayloadItem& item : cell.payload_items) {
    lines.push_back({fmt::format("item {}", item.number),
                     fmt::format("{:.4g} kg at {} in the flange frame, carried where payload_item "
                                 "is {}",
                                 item.mass_kg, MmText(item.cog_F), item.number)});
  }
  lines.push_back({"measurement", MeasurementText(cell.measurement)});
  lines.push_back({"point frame", config::PointFrameText(cell)});
  std::string effects;
  for (const model::WrittenEffect& effect : cell.effects) {
    effects += (effects.empty() ? "" : ", ") + effect.id;
  }
  lines.push_back({"effects", effects.empty() ? "none added" : effects});
  lines.push_back({"domain", DomainText(cell)});
  const auto unmeasured = [&](const std::string& text) {
    if (!text.empty()) lines.push_back({"domain", text + ": its points are extrapolated"});
  };
  for (int k = 0; k < cell.tools(); ++k) unmeasured(config::UnmeasuredToolText(cell, k));
  for (const model::PayloadItem& item : cell.payload_items) {
    unmeasured(config::UnmeasuredItemText(cell, item.number));
  }
  return lines;
}

std::vector<SummaryLine> Summary(const CheckedFile& checked) {
  if (!checked.cell) return {};
  std::vector<SummaryLine> lines = CellSummary(*checked.cell);
  if (checked.config) {
    const config::DaemonConfig& config = *checked.config;
    for (SummaryLine& line : lines) {
      if (line.topic == "payload") line.text = PayloadText(config);
    }
    const std::size_t points = config.machine.points.size();
    lines.push_back({"controller", ControllerText(config.robot)});
    for (const config::CameraConfig& camera : config.vision.cameras) {
      const std::string name = status::CameraNameText(camera.name);
      lines.push_back({name.empty() ? "camera" : "camera " + name, CameraText(camera)});
    }
    lines.push_back({"points", fmt::format("{} assembly point{}, cycle {:g} ms, PLC port {}",
                                           points, points == 1 ? "" : "s",
                                           1e3 * config.cycle_period_s, config.plc.tcp.port)});
    if (checked.model_applied) {
      lines.push_back({"model",
                       "an applied model is in force instead of the cell file; the points below "
                       "are computed with it"});
    }
  }
  return lines;
}

nlohmann::json JsonOf(const CheckedFile& checked, const std::string& file) {
  nlohmann::json json = {{"schema", 1},
                         {"file", file},
                         {"kind", checked.is_configuration ? "configuration" : "cell"},
                         {"good", checked.cell.has_value()},
                         {"faults", nlohmann::json::array()},
                         {"warnings", nlohmann::json::array()},
                         {"summary", nlohmann::json::object()}};
  for (const config::Fault& fault : checked.faults.All()) {
    const bool warning = fault.severity == config::Fault::Severity::kWarning;
    json[warning ? "warnings" : "faults"].push_back(
        {{"file", fault.file}, {"line", fault.line}, {"key", fault.key}, {"what", fault.what}});
  }
  for (const SummaryLine& line : Summary(checked)) json["summary"][line.topic] = line.text;
  if (checked.config) json["points"] = PointsJson(checked.in_force, checked.points);
  return json;
}

/// "no faults", "2 faults, 1 warning"
std::string CountText(const config::FaultList& faults) {
  const auto warnings =
      std::count_if(faults.All().begin(), faults.All().end(), [](const config::Fault& fault) {
        return fault.severity == config::Fault::Severity::kWarning;
      });
  const auto count = static_cast<std::ptrdiff_t>(faults.All().size()) - warnings;
  const auto text = [](std::ptrdiff_t number, const char* what) {
    return fmt::format("{} {}{}", number == 0 ? "no" : std::to_string(number), what,
                       number == 1 ? "" : "s");
  };
  return text(count, "fault") + (warnings > 0 ? ", " + text(warnings, "warning") : "");
}

/// One line for each fault and warning.
std::string FaultLines(const config::FaultList& faults, bool colours) {
  constexpr std::string_view kWarning = ": warning: ";
  std::string text;
  for (const config::Fault& fault : faults.All()) {
    std::string line = config::FaultText(fault);
    if (const auto at = line.find(kWarning); at != std::string::npos) {
      line.replace(at, kWarning.size(),
                   ": " + terminal::Painted("warning:", terminal::Tone::kWarning, colours) + " ");
    } else {
      line = terminal::Painted(line, terminal::Tone::kFault, colours);
    }
    text += line + '\n';
  }
  return text;
}

int Run(const CheckOptions& options) {
  const Result<std::string> text = files::ReadTextFile(options.file);
  if (!text) {
    std::cerr << options.file << ": " << files::ReadErrorText(options.file, text.error()) << '\n';
    return kExitFault;
  }
  const CheckedFile checked = Check(*text, options.file);
  if (options.json) {
    std::cout << text::JsonText(JsonOf(checked, options.file), 2) << '\n';
  } else {
    std::cout << terminal::ForReading
              << FaultLines(checked.faults, terminal::ShowsColours(std::cout));
    for (const SummaryLine& line : Summary(checked)) {
      std::cout << fmt::format("{:12} {}\n", line.topic, line.text);
    }
    std::cout << PointTable(checked.in_force, checked.points);
    const terminal::Tone tone = checked.faults.All().empty() ? terminal::Tone::kGood
                                : checked.faults.HasFaults() ? terminal::Tone::kFault
                                                             : terminal::Tone::kWarning;
    std::cout << '\n'
              << options.file << ": "
              << terminal::Painted(CountText(checked.faults), tone,
                                   terminal::ShowsColours(std::cout))
              << '\n';
  }
  return checked.cell ? kExitOk : kExitFault;
}

}  // namespace

void AddCheckCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<CheckOptions>();
  CLI::App* command =
      app.add_subcommand("check", "Check a cell or configuration file and report every fault");
  command->add_option("file", options->file, "CELL.toml, or the daemon's plumbline.toml")
      ->required();
  command->add_flag("--json", options->json, "Print faults, warnings and summary as JSON");
  command->footer(
      "A plumbline.toml is checked together with the cell, profile and object table that it "
      "refers\n"
      "to, and with the model in force in its state directory. Each point is solved with its\n"
      "payload; the result lists the correction, the 95 % radius and its basis, the posture, the\n"
      "nearest joint limit and the smallest singular value. A point out of the arm's reach is a\n"
      "warning: the daemon starts without it.\n\n"
      "Example:\n  plumbline check config/cells/ur10.toml\n\n"
      "Exit codes: 0 no faults (there may be warnings), 1 faults or an unreadable file, 2 wrong\n"
      "arguments.");
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace plumbline::cli
