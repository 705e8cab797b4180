// plumbline plan: which postures to measure first.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <iostream>

#include "app/base/config/cell_reader.h"
#include "app/cli/commands.h"
#include "app/cli/failure.h"
#include "app/cli/number_option.h"
#include "app/cli/output_file.h"
#include "app/measure/plan/plan_text.h"
#include "firmware-like/geometry/units.h"
#include "firmware-like/model/joint_columns.h"

namespace plumbline::cli {
namespace {

struct PlanOptions {
  std::string cell, csv, svg, urscript, points;
  measure::PlanTask task;
  double sigma_mm = 0.05, floor_mm = 0, link_radius_mm = 0;
  std::vector<double> joint_speeds;  ///< [deg/s] or [mm/s]
  double row_s = 20;
};

/// The stated speeds in SI, one per joint; one value applies to all joints.
Result<model::JointVector> JointSpeeds(const PlanOptions& options,
                                       const std::vector<model::Joint>& joints) {
  const std::vector<double>& stated = options.joint_speeds;
  if (stated.empty()) return model::JointVector();
  if (stated.size() != 1 && stated.size() != joints.size()) {
    return Error{
        fmt::format("--joint-speeds-deg-s: {} values for {} joints; give one for all or "
                    "one for each",
                    stated.size(), joints.size())};
  }
  model::JointVector speeds(static_cast<Eigen::Index>(joints.size()));
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const double in_file = stated.size() == 1 ? stated.front() : stated[i];
    speeds[static_cast<Eigen::Index>(i)] = in_file / model::PositionForm(joints[i].type).from_SI;
  }
  return speeds;
}

/// "time: about 12 min: 2.0 min of moves at the stated speeds, and 30 measurements of 20 s".
std::string TimeText(const PlanOptions& options, const measure::MeasurementPlan& plan) {
  if (!plan.moves_s) {
    return "time: not estimated; give the speed limits of the joints as --joint-speeds-deg-s";
  }
  const double all_s = *plan.moves_s + options.row_s * static_cast<double>(plan.rows.size());
  return fmt::format(
      "time: about {:.0f} min: {:.1f} min of moves at the stated speeds (acceleration neglected), "
      "and {} measurements of {:.0f} s{}",
      std::max(1.0, std::ceil(all_s / 60)), *plan.moves_s / 60, plan.rows.size(), options.row_s,
      plan.load_changes == 0 ? ""
                             : fmt::format("; plus {} change{} of the load", plan.load_changes,
                                           plan.load_changes == 1 ? "" : "s"));
}

/// What the plan assumes to be mounted and carried, and how to choose otherwise.
std::string LoadAssumptions(const measure::PlanTask& task, const model::CellModel& cell) {
  std::string text;
  const std::optional<int> tool = task.tool_number ? task.tool_number : cell.tool.number;
  if (tool) {
    text +=
        fmt::format("assumed: tool {}{} is mounted at every row\n", *tool,
                    task.tool_number ? "" : ", the first of the cell (--tool chooses another),");
  }
  if (!cell.payload_items.empty() && task.payload_items.empty()) {
    text += "assumed: no payload item is carried (--payload-items states those that can be)\n";
  }
  if (cell.payload_cog_F && task.payloads_kg.empty()) {
    text += "assumed: no payload is carried (--payloads-kg states those that can be)\n";
  }
  return text;
}

bool WritePlanFile(const std::string& path, const std::string& text) {
  return path.empty() || WriteOutput(path, text, "file");
}

void PrintPlan(const PlanOptions& options, const measure::MeasurementPlan& plan,
               const model::CellModel& cell) {
  std::cerr << fmt::format(
      "{}: {} rows chosen from {} safe postures; they hold {:.2f} times the information about a "
      "parameter that random postures hold (geometric mean)\n",
      options.cell, plan.rows.size(), plan.candidates, plan.efficiency);
  std::cerr << LoadAssumptions(options.task, cell);
  std::cerr
      << "standard deviation of a parameter after the measurement, as a share of its plausible "
         "size (median; 1: nothing is learnt):\n"
         "effect                  parameters  planned  random\n";
  for (const measure::EffectDetermination& effect : plan.effects) {
    std::cerr << fmt::format("  {:<24}{:>6}   {:8.3f} {:8.3f}\n", effect.id, effect.parameters,
                             effect.planned, effect.random);
  }
  if (!plan.excluded.empty()) std::cerr << "effects that these rows cannot show:\n";
  for (const std::string& one : plan.excluded) std::cerr << "  " << one << '\n';
  std::cerr
      << fmt::format(
             "order: sorted {}for short moves; the path has {:.0f} % of its length in the order "
             "of selection\n",
             plan.load_changes == 0 ? "" : "by load, then ", 100 * plan.path_share)
      << TimeText(options, plan) << '\n';
  std::vector<std::size_t> not_free;  // the robot comes to the first row from anywhere
  for (std::size_t k = 1; k < plan.rows.size(); ++k) {
    if (!plan.rows[k].move_checked) not_free.push_back(k + 1);
  }
  if (!not_free.empty()) {
    std::cerr << fmt::format(
        "no straight joint move that is free of collisions was found to row{} {}: guide the robot "
        "there, or add via points\n",
        not_free.size() == 1 ? "" : "s", fmt::join(not_free, ", "));
  }
  std::cerr << "Only what the cell declares was checked for collisions. Run the program at reduced "
               "speed first.\n";
}

int RunPlan(PlanOptions options) {
  if (options.csv.empty() && options.svg.empty() && options.urscript.empty() &&
      options.points.empty()) {
    std::cerr << "plumbline plan: give --output, --svg, --urscript or --points\n";
    return kExitUsage;
  }
  const OutputPaths outputs = {{"--output", options.csv},
                               {"--svg", options.svg},
                               {"--urscript", options.urscript},
                               {"--points", options.points}};
  if (OverwritesFile("plan", outputs, {options.cell}, std::cerr)) return kExitUsage;
  config::FaultList faults;
  const auto cell = config::ReadCell(options.cell, faults);
  std::cerr << config::FaultsText(faults);
  if (!cell) return kExitFault;
  const std::vector<model::Joint>& joints = cell->robot.joints;
  const bool six_turn = joints.size() == 6 &&
                        std::all_of(joints.begin(), joints.end(), [](const model::Joint& joint) {
                          return joint.type == model::JointType::kRevolute;
                        });
  if (!options.urscript.empty() && !six_turn) {
    std::cerr << "plumbline plan: --urscript is for arms with six revolute joints; use --points\n";
    return kExitUsage;
  }
  options.task.sigma_m = kMetrePerMm * options.sigma_mm;
  options.task.rules.floor_m = kMetrePerMm * options.floor_mm;
  options.task.rules.link_radius_m = kMetrePerMm * options.link_radius_mm;
  const Result<model::JointVector> speeds = JointSpeeds(options, joints);
  if (!speeds) {
    std::cerr << "plumbline plan: " << speeds.error() << '\n';
    return kExitUsage;
  }
  options.task.joint_speeds = *speeds;
  const auto plan = measure::PlanMeasurements(*cell, options.task);
  if (!plan) {
    std::cerr << options.cell << ": " << plan.error() << '\n';
    return kExitFault;
  }
  if (!WritePlanFile(options.csv, PlanCsv(*plan, joints)) ||
      !WritePlanFile(options.svg, PlanSvg(*plan, *cell)) ||
      !WritePlanFile(options.urscript, UrScript(*plan)) ||
      !WritePlanFile(options.points, PointList(*plan, joints))) {
    return kExitUsage;
  }
  PrintPlan(options, *plan, *cell);
  return kExitOk;
}

}  // namespace

void AddPlanCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<PlanOptions>();
  CLI::App* command = app.add_subcommand("plan", "Choose the postures to be measured first");
  command->add_option("cell", options->cell, "Model of the cell, CELL.toml")->required();
  command->add_option("--rows", options->task.rows, "Number of rows")
      ->capture_default_str()
      ->check(WholeNumberWithin(3, 500));
  command->add_option("--artefacts", options->task.artefacts,
                      "[[artefact]] of the cell to touch, one or more; without it, positions are "
                      "measured");
  command->add_option("--payloads-kg", options->task.payloads_kg, "Payloads that can be carried")
      ->check(NumberWithin(0, 5000));
  command->add_option("--tool", options->task.tool_number,
                      "Number of the mounted [[tool]]; without it, the cell's first");
  command->add_option("--payload-items", options->task.payload_items,
                      "Numbers of the [[payload.item]] that can be carried, 0: none");
  command
      ->add_option("--sigma-mm", options->sigma_mm,
                   "Standard deviation of the instrument, if the cell declares none")
      ->capture_default_str()
      ->check(NumberWithin(1e-5, 100));
  command->add_option("--floor-mm", options->floor_mm, "Lowest height of the arm above its base")
      ->capture_default_str()
      ->check(NumberWithin(-100000, 100000));
  command
      ->add_option("--link-radius-mm", options->link_radius_mm,
                   "Radius of the links for the collision check; 0: a twentieth of the reach")
      ->check(NumberWithin(0, 10000));
  command->add_option("--candidates", options->task.candidates, "Postures to choose from")
      ->capture_default_str()
      ->check(WholeNumberWithin(50, 5000));
  command
      ->add_option("--joint-speeds-deg-s", options->joint_speeds,
                   "Speed limit of all joints, or of each (prismatic: mm/s), for order and time")
      ->check(NumberWithin(0.01, 100000));
  command->add_option("--seconds-per-row", options->row_s, "Time for one measurement")
      ->capture_default_str()
      ->check(NumberWithin(0, 86400));
  command->add_option("--output,--out", options->csv, "Table of the rows, CSV");
  command->add_option("--svg", options->svg, "Picture of the tips");
  command->add_option("--urscript", options->urscript, "Program for Universal Robots");
  command->add_option("--points", options->points, "Tab-separated points for other controllers");
  command->footer(
      "The rows are D-optimal for all effects of the catalogue that such rows can show. Postures\n"
      "are within the joint limits, away from singularities, and free of collisions with the arm\n"
      "itself, the floor and the planes of the cell.\n\n"
      "Examples:\n"
      "  plumbline plan config/cells/ur10.toml --rows 30 \\\n"
      "      --output plan.csv --svg plan.svg\n"
      "  plumbline plan cell.toml --artefacts left_0 left_1 --urscript plan.script\n"
      "  plumbline plan cell.toml --tool 2 --payload-items 0 1 --output plan.csv\n\n"
      "Exit codes: 0 the files were written, 1 faults in the cell, or no such postures, 2 wrong\n"
      "arguments or unwritable output.");
  command->callback([options, &exit_code] { exit_code = RunPlan(*options); });
}

}  // namespace plumbline::cli
