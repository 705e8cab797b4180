// plumbline export-urdf: corrected kinematics written back into a URDF.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <iostream>
#include <set>

#include "app/base/config/cell_reader.h"
#include "app/base/config/required_file.h"
#include "app/base/config/wrong_file.h"
#include "app/cli/commands.h"
#include "app/cli/failure.h"
#include "app/cli/output_file.h"
#include "app/cli/tool_option.h"
#include "app/cli/urdf_options.h"
#include "app/measure/urdf/chain_difference.h"
#include "app/measure/urdf/corrected_urdf.h"
#include "app/measure/urdf/static_geometry.h"
#include "firmware-like/deflection/loaded_arm.h"
#include "firmware-like/geometry/units.h"

namespace plumbline::cli {
namespace {

struct ExportUrdfOptions {
  std::string cell, file, out;
  ChainEnds ends;
  std::optional<int> tool;  ///< number
};

constexpr int kExportedPostures = 1000;

/// What the cell's model has and a URDF has no place for, one line each.
std::vector<std::string> NotCarried(const model::CellModel& cell,
                                    const measure::StaticGeometry& geometry, int index) {
  const model::Tool& tool = cell.ToolAt(index);
  std::vector<std::string> lines;
  const std::set<std::string> left(geometry.left_out.begin(), geometry.left_out.end());
  if (!left.empty()) {
    lines.push_back(fmt::format(
        "effects that depend on posture, load, motion, time or temperature, or that belong to the "
        "tool or the base: {}",
        fmt::join(left, ", ")));
  }
  for (const model::Joint& joint : cell.robot.joints) {
    if (joint.compliance_rad_per_Nm.value_or(0) == 0) continue;
    lines.emplace_back("compliance_rad_per_Nm: the joints' wind-up under load");
    break;
  }
  if (!cell.robot.couplings.empty()) {
    lines.emplace_back(
        "[[robot.coupling]]: the URDF's joints are the axes. To command the URDF, add ratio x the "
        "other joint's reading to the coupled joint's reading.");
  }
  if (!tool.rigid) lines.emplace_back("[tool]: the bending of the tool");
  if (!tool.rigid || !tool.tcp_F.isZero()) {
    lines.emplace_back("[tool]: its tip; the chain ends at the flange");
  }
  if (!cell.sessions.empty()) {
    lines.emplace_back("[[session]]: the place of the robot in the instrument's frame");
  }
  if (cell.domain) {
    lines.emplace_back(
        "[domain]: the range of the fitted poses, and the fading of the correction outside it");
  }
  if (!geometry.included.empty()) {
    lines.emplace_back("standard deviations and covariances of the corrections");
  }
  return lines;
}

/// Distance between the exported tip and the flange of the full model, deflected by the arm's own
/// weight; nullopt if the model cannot be evaluated.
std::optional<measure::ChainDifference> LeftByUrdf(const model::CellModel& cell,
                                                   const measure::JointChain& exported,
                                                   const Pose& X_base_B, int tool) {
  const deflection::LoadedArm arm(cell);
  if (arm.torques_missing()) return std::nullopt;
  measure::ChainDifference difference;
  deflection::LoadedState state;
  loads::Payload payload;
  payload.tool = tool;
  for (const model::JointVector& q : measure::RandomPostures(cell.robot, kExportedPostures)) {
    if (!arm.AtCommanded(q, payload, effects::Conditions{}, state)) return std::nullopt;
    difference.Add(TipPose(exported, arm.chain().AxisPositions<double>(q)),
                   X_base_B * state.posture.X_BF());
  }
  return difference;
}

void PrintExport(const ExportUrdfOptions& options, const model::CellModel& cell,
                 const measure::StaticGeometry& geometry,
                 const measure::CorrectedOrigins& corrected, const measure::JointChain& exported,
                 int tool) {
  std::ostream& out = options.out == "-" ? std::cerr : std::cout;
  out << fmt::format("{}: {} of {} effects written into {} joint origin{}\n", options.out,
                     geometry.included.size(), geometry.included.size() + geometry.left_out.size(),
                     corrected.origins.size(), corrected.origins.size() == 1 ? "" : "s");
  for (const measure::MovedOrigin& moved : corrected.origins) {
    out << fmt::format("  {:<24} {:9.4f} mm {:9.5f} deg\n", moved.joint, 1e3 * moved.distance_m,
                       kDegPerRad * moved.angle_rad);
  }
  std::vector<std::string> not_carried = NotCarried(cell, geometry, tool);
  if (corrected.tip_left_m > 1e-9 || corrected.tip_left_rad > 1e-9) {
    not_carried.insert(
        not_carried.begin(),
        fmt::format("a change of the flange by {:.4f} mm and {:.5f} deg: no fixed joint lies "
                    "between the last axis and link {}; add one and export with its child as --tip",
                    1e3 * corrected.tip_left_m, kDegPerRad * corrected.tip_left_rad, exported.tip));
  }
  if (not_carried.empty()) {
    out << "The URDF carries every effect of the model; the cell's base, masses, limits and "
           "gravity are not compared with it.\n";
    return;
  }
  out << "A URDF cannot carry:\n";
  for (const std::string& line : not_carried) out << "  " << line << '\n';
  const std::string used = UsedToolText(cell, tool, options.tool);
  if (const auto left = LeftByUrdf(cell, exported, corrected.X_base_B, tool)) {
    out << fmt::format(
        "Without it the flange is up to {:.3f} mm and {:.4f} deg from the cell's model ({} "
        "postures, no payload, base and instrument not counted{}).\n",
        1e3 * left->distance_m, kDegPerRad * left->angle_rad, kExportedPostures,
        used.empty() ? "" : "; " + used);
  }
}

int RunExportUrdf(const ExportUrdfOptions& options) {
  if (OverwritesFile("export-urdf", {{"--output", options.out}}, {options.cell, options.file},
                     std::cerr)) {
    return kExitUsage;
  }
  config::FaultList faults;
  const auto cell = config::ReadCell(options.cell, faults);
  const auto text = config::ReadRequiredFile(options.file, faults);
  const auto read = [&](const std::string& from) -> std::optional<measure::JointChain> {
    if (config::RefuseWrongFile(from, options.file, config::kWantedUrdf, faults)) {
      return std::nullopt;
    }
    const auto file = measure::UrdfFromText(from, options.file, faults);
    if (!file) return std::nullopt;
    return measure::ChainFromUrdf(*file, options.file, options.ends.base, options.ends.tip,
                                  options.ends.rising(), faults);
  };
  const auto chain = text ? read(*text) : std::nullopt;
  std::cerr << config::FaultsText(faults);
  if (!cell || !chain) return kExitFault;
  const Result<int> tool = ToolChoice(*cell, options.tool);
  if (!tool) {
    std::cerr << "plumbline export-urdf: " << tool.error() << '\n';
    return kExitUsage;
  }
  const measure::StaticGeometry geometry = measure::StaticGeometryOf(*cell);
  const auto file = measure::UrdfFromText(*text, options.file, faults);
  const auto corrected = measure::CorrectedOriginsOf(*file, *chain, cell->robot, geometry.robot);
  if (!corrected) {
    std::cerr << options.file << ": " << corrected.error() << '\n';
    return kExitFault;
  }
  const std::string exported = measure::UrdfWithOrigins(*text, corrected->origins);
  if (!PrintOrWriteOutput(options.out, exported, "--output")) return kExitUsage;
  if (const auto back = read(exported)) {
    PrintExport(options, *cell, geometry, *corrected, *back, *tool);
  }
  return kExitOk;
}

}  // namespace

void AddExportUrdfCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<ExportUrdfOptions>();
  CLI::App* command =
      app.add_subcommand("export-urdf", "Write a cell's corrected kinematics into its URDF");
  command->add_option("cell", options->cell, "Corrected cell, CORRECTED.toml of diagnose")
      ->required();
  command->add_option("file", options->file, "URDF that the cell was imported from")->required();
  AddChainEnds(*command, options->ends);
  AddToolOption(*command, options->tool);
  command->add_option("--output,--out", options->out, "URDF to write; - is standard output")
      ->required();
  command->footer(
      "Constant corrections of the links and joints go into the origins of the moving joints and "
      "of\n"
      "the first fixed joint after the last axis; everything else in the file stays as it is. "
      "What\n"
      "a URDF has no place for is listed, with the error that is left without it.\n\n"
      "Examples:\n"
      "  plumbline export-urdf corrected.toml robot.urdf --output corrected.urdf\n"
      "  plumbline export-urdf corrected.toml arm.urdf --tip flange --output new.urdf\n\n"
      "Exit codes: 0 the URDF was written, 1 faults in a file, or the cell is not of this URDF,\n"
      "2 wrong arguments or unwritable output.");
  command->callback([options, &exit_code] { exit_code = RunExportUrdf(*options); });
}

}  // namespace plumbline::cli
