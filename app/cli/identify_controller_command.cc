// plumbline identify-controller: names the model that a controller computes its tool pose with.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <iostream>
#include <memory>

#include "app/base/config/cell_reader.h"
#include "app/base/config/daemon_config_reader.h"
#include "app/base/config/required_file.h"
#include "app/base/terminal/terminal_output.h"
#include "app/base/text/json_text.h"
#include "app/cli/commands.h"
#include "app/cli/controller_files.h"
#include "app/cli/doctor/robot_postures.h"
#include "app/cli/failure.h"
#include "app/cli/number_option.h"
#include "app/cli/output_file.h"
#include "app/cli/progress.h"
#include "app/measure/controller/relation_text.h"
#include "app/measure/urdf/dh_table.h"
#include "app/measure/urdf/factory_table.h"
#include "firmware-like/geometry/units.h"
#include "firmware-like/loads/numbered_load.h"

namespace plumbline::cli {
namespace {

using measure::Identification;

struct IdentifyOptions {
  std::string cell, poses, robot, factory, orientation, output, save;
  std::string ur_angles = "rpy";
  double seconds = 120, noise_mm = 0, noise_deg = 0;
  int tool = -1;
  bool flange = false, moving = false, json = false, quiet = false;
};

const char* VerdictText(Identification::Verdict verdict) {
  switch (verdict) {
    case Identification::Verdict::kNamed:
      return "named";
    case Identification::Verdict::kNotClear:
      return "not_clear";
    case Identification::Verdict::kNone:
      return "none";
    case Identification::Verdict::kTooFew:
      return "too_few";
  }
  return "";
}

const char* CompensationText(measure::Compensation compensation) {
  return compensation == measure::Compensation::kDeflection    ? "deflection"
         : compensation == measure::Compensation::kCalibration ? "calibration"
                                                               : "none";
}

nlohmann::ordered_json ErrorJson(const measure::PoseError& error) {
  return {{"mm", text::NumberJson(kMmPerMetre * error.distance_m)},
          {"deg", text::NumberJson(kDegPerRad * error.angle_rad)}};
}

nlohmann::ordered_json FitJson(const measure::HypothesisFit& fit,
                               const measure::RelationContext& context) {
  nlohmann::ordered_json relations = nlohmann::ordered_json::array();
  for (const measure::Relation& one : fit.hypothesis) {
    nlohmann::ordered_json json = {{"kind", measure::NameOf(one.kind)}};
    if (one.joint >= 0) json["joint"] = one.joint + 1;
    if (one.kind == measure::RelationKind::kCoupling) json["of"] = one.other + 1;
    if (one.kind == measure::RelationKind::kTableValue) json["value"] = one.other == 0 ? "a" : "d";
    if (one.kind == measure::RelationKind::kAngleConvention)
      json["convention"] = measure::AngleConventions()[static_cast<std::size_t>(one.other)].name;
    if (one.kind == measure::RelationKind::kOtherTool) {
      if (const auto number = context.cell.ToolAt(one.other).number) json["tool"] = *number;
    }
    relations.push_back(json);
  }
  return {{"relations", relations},
          {"text", RelationText(fit, context)},
          {"held_out", ErrorJson(fit.held_out)},
          {"chi_square", text::NumberJson(fit.held_out_chi_square)},
          {"numbers", fit.degrees}};
}

std::string PostureText(const model::Robot& robot, const model::JointVector& q) {
  std::vector<std::string> parts;
  for (int i = 0; i < q.size(); ++i) {
    const bool turns =
        robot.joints[static_cast<std::size_t>(i)].type == model::JointType::kRevolute;
    parts.push_back(fmt::format("{:.0f}", q[i] * (turns ? kDegPerRad : kMmPerMetre)));
  }
  return fmt::format("{}", fmt::join(parts, ", "));
}

struct Report {
  Identification found;
  std::vector<measure::CellLines> lines{};
  model::CellModel changed{};
  bool twice = false;
};

std::string ReportJson(const Report& report, const measure::RelationContext& context) {
  const Identification& found = report.found;
  nlohmann::ordered_json json = {{"schema", 1},
                                 {"verdict", VerdictText(found.verdict)},
                                 {"postures", found.postures},
                                 {"finding", FindingText(found, context)}};
  if (found.verdict != Identification::Verdict::kTooFew) {
    json["nominal"] = ErrorJson(found.nominal.held_out);
    json["best"] = FitJson(found.best, context);
    const auto list = [&](const std::vector<measure::HypothesisFit>& fits) {
      nlohmann::ordered_json all = nlohmann::ordered_json::array();
      for (const measure::HypothesisFit& fit : fits) all.push_back(FitJson(fit, context));
      return all;
    };
    json["rivals"] = list(found.rivals);
    json["same_as"] = list(found.same_as);
    json["compensation"] = CompensationText(found.compensation());
    json["compensated_twice"] = report.twice;
    nlohmann::ordered_json lines = nlohmann::ordered_json::array();
    for (const measure::CellLines& one : report.lines)
      lines.push_back({{"place", one.place}, {"lines", one.lines}, {"advice", one.advice}});
    json["write"] = lines;
    nlohmann::ordered_json next = nlohmann::ordered_json::array();
    for (const model::JointVector& q : found.next) {
      nlohmann::ordered_json posture = nlohmann::ordered_json::array();
      for (int i = 0; i < q.size(); ++i) {
        const bool turns = context.arm.chain().type(i) == model::JointType::kRevolute;
        posture.push_back(std::round(q[i] * (turns ? kDegPerRad : kMmPerMetre)));
      }
      next.push_back(posture);
    }
    json["next_postures"] = next;
    json["follows"] = found.follows;
    nlohmann::ordered_json outlying = nlohmann::ordered_json::array();
    for (const measure::OutlyingRow& one : found.outlying) {
      outlying.push_back(
          {{"row", one.row + 1}, {"line", one.line}, {"error", ErrorJson(one.error)}});
    }
    json["outlying"] = outlying;
    std::vector<int> unmoved;
    for (const int joint : found.unmoved) unmoved.push_back(joint + 1);
    json["unmoved"] = unmoved;
  }
  return text::JsonText(json, 1) + "\n";
}

std::string ErrorText(const measure::PoseError& error, bool with_orientation) {
  const std::string length = fmt::format("{:.4f} mm", kMmPerMetre * error.distance_m);
  return with_orientation ? fmt::format("{}, {:.5f} deg", length, kDegPerRad * error.angle_rad)
                          : length;
}

/// What was compared with a difference that follows nothing, and what could not be.
std::string NothingFollowed(const measure::ControllerSample& sample) {
  std::vector<std::string> compared = {"the joints"}, missing;
  const auto sort = [&](const char* signal, const char* column, auto has) {
    const bool all = std::all_of(sample.postures.begin(), sample.postures.end(), has);
    (all ? compared : missing).emplace_back(all ? signal : column);
  };
  using Posture = measure::ControllerPosture;
  sort("the payload", "payload_kg", [](const Posture& one) { return one.payload.has_value(); });
  sort("the temperature", "temp_C", [](const Posture& one) { return one.temp_C.has_value(); });
  sort("the time", "t_s", [](const Posture& one) { return one.t_s.has_value(); });
  std::string text = fmt::format("the difference follows none of: {}\n", fmt::join(compared, ", "));
  if (!missing.empty()) {
    text +=
        fmt::format("not compared, because not every row has it: {}\n", fmt::join(missing, ", "));
  }
  return text +
         "compare at standstill: joints and pose of different times differ by the motion between "
         "them; then check the noise (--noise-mm) and external axes\n";
}

std::string ReportText(const Report& report, const measure::RelationContext& context,
                       const measure::ControllerSample& sample) {
  const Identification& found = report.found;
  std::string text = FindingText(found, context) + "\n";
  if (found.verdict == Identification::Verdict::kTooFew)
    return text + FindingRemedy(found, context, sample) + "\n";
  if (report.twice) {
    text +=
        "COMPENSATED TWICE: the controller's pose already contains what this cell corrects. "
        "Use one of the two\n";
  }
  // Beside the cell's own table, other descriptions of the same are of no use.
  for (std::size_t k = 0; k < found.same_as.size() && !found.IsNominal(); ++k)
    text += fmt::format("the same in every posture: {}\n", RelationText(found.same_as[k], context));
  if (!sample.with_orientation)
    text += "position only: without reported orientations, nothing is known of the orientation\n";
  const bool turned = sample.with_orientation;
  text += fmt::format("postures held out: {} from the cell's table, {} from this ({} postures)\n",
                      ErrorText(found.nominal.held_out, turned),
                      ErrorText(found.best.held_out, turned), found.postures);
  if (found.verdict == Identification::Verdict::kNone) {
    text += fmt::format("nearest: {}; it does not explain the rest\n",
                        RelationText(found.best, context));
    measure::ControllerSample positions = sample;
    positions.with_orientation = false;
    if (turned && measure::RelationFitter(context, positions).FitAndPredict({{}}).Accepted()) {
      text +=
          "the positions agree with the cell: only the unit or the form of the orientation can be "
          "wrong. Check the names of its columns, or state its form: --orientation\n";
    }
    text += found.follows.empty()
                ? NothingFollowed(sample)
                : fmt::format("the difference follows {}\n", fmt::join(found.follows, " and "));
  }
  if (!found.unmoved.empty()) {
    std::vector<int> joints;
    for (const int joint : found.unmoved) joints.push_back(joint + 1);
    text += fmt::format("joint {} hardly moved: nothing is known of its sign, zero or coupling\n",
                        fmt::join(joints, ", "));
  }
  if (!found.next.empty()) {
    text += "measure these postures as well; check first that the robot can reach them safely:\n";
    for (const model::JointVector& q : found.next)
      text += fmt::format("  {}\n", PostureText(context.cell.robot, q));
  } else if (found.verdict == Identification::Verdict::kNotClear) {
    text += "more postures of the same resolution hardly separate them: use finer registers\n";
  }
  if (found.verdict == Identification::Verdict::kNamed) {
    for (const measure::CellLines& one : report.lines) {
      if (!one.lines.empty()) text += fmt::format("{}:\n", one.place);
      for (const std::string& line : one.lines) text += fmt::format("  {}\n", line);
      if (!one.advice.empty())
        text += fmt::format("  {}{}\n", one.lines.empty() ? "" : "# ", one.advice);
    }
  }
  return text;
}

std::optional<model::Robot> FactoryTable(const IdentifyOptions& options,
                                         const model::CellModel& cell, config::FaultList& faults) {
  const auto text = config::ReadRequiredFile(options.factory, faults);
  if (!text) return std::nullopt;
  const auto angles =
      options.ur_angles == "xyz" ? measure::TableAngles::kXyz : measure::TableAngles::kRollPitchYaw;
  const auto chain = measure::ChainFromFactoryTable(*text, options.factory, angles, faults);
  if (!chain) return std::nullopt;
  model::Robot robot = measure::RobotFromChain(*chain);
  if (robot.size() == cell.robot.size()) return robot;
  faults.Add(
      {.file = options.factory,
       .key = "",
       .what = fmt::format("has {} joints, but the cell has {}", robot.size(), cell.robot.size())});
  return std::nullopt;
}

std::optional<int> ToolNumber(const IdentifyOptions& options) {
  return options.tool >= 0 ? std::optional<int>(options.tool) : std::nullopt;
}

int RunIdentify(const IdentifyOptions& options) {
  const auto usage = [](const std::string& why) {
    return Fail(
        "plumbline identify-controller: " + why + "; see plumbline identify-controller --help",
        kExitUsage);
  };
  if (options.poses.empty() == options.robot.empty())
    return usage("give either a table of POSES or --robot");
  for (const std::string& file : {options.output, options.save}) {
    if (!file.empty() && file != "-" && !CanWriteOutput(file, "output")) return kExitUsage;
  }
  config::FaultList faults;
  const auto text = config::ReadRequiredFile(options.cell, faults);
  const auto cell = text ? config::CellFromText(*text, options.cell, faults) : std::nullopt;
  if (!cell) return Fail(config::FaultsText(faults));
  measure::RelationContext context(*cell);
  faults = {};
  if (!options.factory.empty()) context.factory = FactoryTable(options, *cell, faults);
  if (faults.HasFaults()) return Fail(config::FaultsText(faults));
  Interruption interruption;
  Progress progress(std::cerr, options.quiet || options.json);
  std::optional<measure::ControllerSample> sample;
  if (!options.poses.empty()) {
    sample = ReadControllerSample(options.poses, *cell, options.orientation, faults);
  } else if (const auto config = config::ReadDaemonConfig(options.robot, faults)) {
    const auto postures =
        CollectPostures(*config, context.cell, options.seconds, options.moving, ToolNumber(options),
                        [&](double share, std::size_t kept) {
                          progress.Show(0.9 * share, fmt::format("{} postures", kept));
                          return !Interruption::Requested();
                        });
    if (Interruption::Requested()) return Interrupted();
    if (!postures) return Fail(postures.error());
    sample = postures.value();
  }
  if (!sample) return Fail(config::FaultsText(faults));
  std::cerr << config::FaultsText(faults);
  if (options.tool >= 0) {
    const auto index = loads::ToolIndexOf(*cell, options.tool);
    if (!index) return usage(fmt::format("the cell has no tool {}", options.tool));
    for (measure::ControllerPosture& posture : sample->postures) posture.tool = *index;
  }
  for (measure::ControllerPosture& posture : sample->postures)
    posture.of_flange = posture.of_flange || options.flange;
  sample->position_step =
      std::max(sample->position_step, options.noise_mm * kMetrePerMm * std::sqrt(12.0));
  sample->angle_step =
      std::max(sample->angle_step, options.noise_deg * kRadPerDeg * std::sqrt(12.0));
  Report report;
  report.found = Identify(context, *sample, [&](double share, const std::string& doing) {
    progress.Show(options.poses.empty() ? 0.9 + 0.1 * share : share, doing);
    return !Interruption::Requested();
  });
  progress.Clear();
  if (Interruption::Requested() || !interruption.Disarm()) return Interrupted();
  const Identification& found = report.found;
  const bool named = found.verdict == Identification::Verdict::kNamed;
  if (named) report.lines = LinesOf(found.best, context, *sample, report.changed);
  report.twice = CompensatedTwice(context, *sample, found);
  std::cout << (options.json ? ReportJson(report, context) : ReportText(report, context, *sample));
  if (!options.save.empty() &&
      !WriteOutput(options.save, ControllerSampleCsv(*sample, cell->robot), "--save-poses")) {
    return kExitUsage;
  }
  if (named && !options.output.empty() && !CellCanHold(found.best)) {
    return Fail(options.output +
                " is not written: no line of a cell is another frame of the controller's poses; "
                "select the robot's own base in the controller, then identify again");
  }
  if (named && !options.output.empty()) {
    const auto changed = ChangedCellText(*text, *cell, report.changed);
    if (!changed) return Fail(options.output + " is not written: " + changed.error());
    if (*changed == *text && !found.IsNominal()) {
      return Fail(options.output +
                  " is not written: it would be the same as the cell. What differs is not in the "
                  "cell: see the lines above");
    }
    if (!PrintOrWriteOutput(options.output, *changed, "--output")) return kExitUsage;
  }
  return found.IsNominal() && !report.twice ? kExitOk : kExitFault;
}

}  // namespace

void AddIdentifyControllerCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<IdentifyOptions>();
  CLI::App* command = app.add_subcommand(
      "identify-controller", "Name the model that a controller computes its tool pose with");
  command->add_option("cell", options->cell, "Cell file that the controller is compared with")
      ->required();
  command->add_option("poses", options->poses,
                      "Postures with the tool pose that the controller reports: q1_deg, .., x_mm, "
                      "y_mm, z_mm and an orientation");
  command->add_option("--robot", options->robot,
                      "Read the robot of this plumbline.toml while it is moved, in place of POSES; "
                      "the daemon must not run");
  command->add_option("--seconds", options->seconds, "How long --robot reads in s")
      ->capture_default_str()
      ->check(NumberWithin(1, 3600));
  command->add_flag("--moving", options->moving,
                    "With --robot: use postures of the moving robot as well");
  command->add_option("--save-poses", options->save, "File for the postures that were used");
  command->add_option("--factory-table", options->factory,
                      "Calibrated joint frames of this arm in YAML, to compare with");
  command
      ->add_option("--ur-angles", options->ur_angles,
                   "How roll, pitch, yaw of that table are read: rpy or xyz")
      ->capture_default_str()
      ->check(CLI::IsMember({"rpy", "xyz"}));
  std::vector<std::string> conventions;
  for (const measure::AngleConvention& one : measure::AngleConventions())
    conventions.emplace_back(one.name);
  command
      ->add_option("--orientation", options->orientation,
                   "What the three columns of an orientation mean, in place of their names")
      ->check(CLI::IsMember(conventions));
  command->add_option("--tool", options->tool, "Number of the mounted tool")
      ->check(WholeNumberWithin(0, 65535));
  command->add_flag("--flange", options->flange, "The poses are those of the flange");
  command
      ->add_option("--noise-mm", options->noise_mm,
                   "Standard deviation of reported positions, if it exceeds their resolution")
      ->check(NumberWithin(0, 100));
  command->add_option("--noise-deg", options->noise_deg, "The same of orientations")
      ->check(NumberWithin(0, 10));
  command->add_option("--output,--out", options->output,
                      "Cell file to write, with the lines that make the relation nominal");
  command->add_flag("--json", options->json, "Print JSON");
  command->add_flag("--quiet", options->quiet, "Show no progress");
  command->footer(
      "Compares the tool pose that a controller reports with the cell, in 10 to 20 postures that\n"
      "differ in every joint. Each known relation (other table, deflection, tool, base, units,\n"
      "orientation, coupling, zero, sign or order of joints, time), and each two of which none\n"
      "suffices alone, is fitted to half of the postures. It is accepted if it predicts the other\n"
      "half within the resolution of the numbers, with values of plausible size. One is named if "
      "it\n"
      "is a thousand times as probable as every other accepted one that differs from it in any\n"
      "posture; otherwise the postures that separate them are printed. The orientation is qw, qx, "
      "qy, qz, "
      "or\n"
      "rx, ry, rz (a rotation vector in _rad or _mrad, roll-pitch-yaw in _deg), roll, pitch, yaw,\n"
      "a, b, c (KUKA), w, p, r (FANUC) or o, a, t, with _deg, _rad or _mrad. payload_kg, t_s, "
      "temp_C,\n"
      "tool and qd1_deg_s .. are used if they are there.\n\n"
      "Examples:\n"
      "  plumbline identify-controller cell.toml poses.csv\n"
      "  plumbline identify-controller cell.toml poses.csv --output corrected.toml\n"
      "  plumbline identify-controller cell.toml poses.csv \\\n"
      "      --factory-table calibration.yaml --json\n"
      "  plumbline identify-controller cell.toml --robot plumbline.toml --seconds 300 \\\n"
      "      --save-poses poses.csv\n\n"
      "Exit codes: 0 the controller uses the cell's own table, 1 it uses something else or it is "
      "not\nclear, or faulty input, 2 wrong arguments or unwritable output.");
  command->callback([options, &exit_code] { exit_code = RunIdentify(*options); });
}

}  // namespace plumbline::cli
