// plumbline import-urdf: a cell from a URDF or from a factory table of joint frames.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>

#include "app/base/config/cell_reader.h"
#include "app/base/config/required_file.h"
#include "app/base/config/wrong_file.h"
#include "app/cli/commands.h"
#include "app/cli/failure.h"
#include "app/cli/output_file.h"
#include "app/cli/urdf_options.h"
#include "app/measure/urdf/cell_text.h"
#include "app/measure/urdf/chain_difference.h"
#include "app/measure/urdf/dh_table.h"
#include "app/measure/urdf/factory_table.h"
#include "app/measure/urdf/right_angles.h"
#include "firmware-like/geometry/units.h"

namespace plumbline::cli {
namespace {

struct ImportUrdfOptions {
  std::string file, out = "-";
  std::string ur_angles = "rpy";
  ChainEnds ends;
};

constexpr int kImportedPostures = 1000;

std::optional<measure::JointChain> ReadChain(const ImportUrdfOptions& options,
                                             config::FaultList& faults) {
  const auto text = config::ReadRequiredFile(options.file, faults);
  if (!text || config::RefuseWrongFile(*text, options.file, config::kWantedArm, faults)) {
    return std::nullopt;
  }
  if (measure::IsFactoryTable(*text)) {
    const auto angles = options.ur_angles == "xyz" ? measure::TableAngles::kXyz
                                                   : measure::TableAngles::kRollPitchYaw;
    return measure::ChainFromFactoryTable(*text, options.file, angles, faults);
  }
  const auto file = measure::UrdfFromText(*text, options.file, faults);
  if (!file) return std::nullopt;
  const auto chain = measure::ChainFromUrdf(*file, options.file, options.ends.base,
                                            options.ends.tip, options.ends.rising(), faults);
  if (!chain) return std::nullopt;
  const auto note = measure::RoundedAnglesNote(*file, options.file, *chain, options.ends.rising());
  if (note) faults.Add(*note);
  return chain;
}

/// Compares the cell, read back from its text, with the chain, and reports how far it is from it.
/// @return  false if that is more than the digits of the text explain
bool ReportImport(const ImportUrdfOptions& options, const std::string& name,
                  const measure::JointChain& chain, const model::CellModel& cell) {
  const measure::ChainDifference difference =
      DifferenceOf(chain, cell.robot, measure::RandomPostures(cell.robot, kImportedPostures));
  const std::string size =
      fmt::format("{:.1g} mm and {:.1g} deg", kMmPerMetre * difference.distance_m,
                  kDegPerRad * difference.angle_rad);
  if (!difference.IsRounding()) {
    std::cerr << fmt::format(
        "{}: no cell is written: over {} postures its flange would be up to {} from {}, and only "
        "1e-6 mm and 1e-6 deg are rounding. The file is not at fault; please report it with this "
        "message\n",
        options.file, kImportedPostures, size, chain.tip);
    return false;
  }
  std::cerr << fmt::format(
      "{}: {} joints from {} to {}; over {} postures the cell's flange is within {} of {}\n", name,
      chain.joints.size(), chain.base, chain.tip, kImportedPostures, size, chain.tip);
  return true;
}

int RunImportUrdf(const ImportUrdfOptions& options) {
  const bool to_out = options.out == "-";
  if (!to_out && SameFile(options.out, options.file)) {
    std::cerr << "plumbline import-urdf: --output would overwrite the input; choose another file\n";
    return kExitUsage;
  }
  config::FaultList faults;
  const auto chain = ReadChain(options, faults);
  std::cerr << config::FaultsText(faults);
  if (!chain) return kExitFault;
  const std::string text =
      measure::CellText(measure::RobotFromChain(*chain), *chain,
                        std::filesystem::path(options.file).filename().string());
  const std::string name = to_out ? "cell" : options.out;
  const auto cell = config::CellFromText(text, name, faults);
  if (!cell) std::cerr << config::FaultsText(faults) << options.file << ": no cell is written\n";
  if (!cell) return kExitFault;
  if (!ReportImport(options, name, *chain, *cell)) return kExitFault;
  return PrintOrWriteOutput(options.out, text, "--output") ? kExitOk : kExitUsage;
}

}  // namespace

void AddImportUrdfCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<ImportUrdfOptions>();
  CLI::App* command = app.add_subcommand(
      "import-urdf", "Make a cell from a URDF or from a factory table of joint frames");
  command
      ->add_option("file", options->file,
                   "URDF (expanded, not xacro), or a factory table in YAML: "
                   "default_kinematics.yaml of a UR, joint1 .. joint7 of an xArm")
      ->required();
  AddChainEnds(*command, options->ends);
  command->add_option("--output,--out", options->out, "Cell file to write; - is standard output")
      ->capture_default_str();
  command
      ->add_option("--ur-angles", options->ur_angles,
                   "How roll, pitch, yaw of a factory table are read: rpy as ROS does, or xyz, "
                   "which gives a UR controller's own table back")
      ->capture_default_str()
      ->check(CLI::IsMember({"rpy", "xyz"}));
  command->footer(
      "The cell has the chain from --base to --tip as an exact Denavit-Hartenberg table, the "
      "joint\n"
      "limits, and the masses of everything fixed to each link. Its measurement frame is the base\n"
      "link, its flange the tip link. Planar, floating and mimicking joints within the chain are\n"
      "refused; move --base or --tip. Faults of links and joints that neither carry the flange "
      "nor\n"
      "move with it are a warning. The cell is read back and compared over 1000 postures; if the\n"
      "flange differs by more than 1e-6 mm or 1e-6 degrees, nothing is written. Angles such as "
      "3.1416\n"
      "are converted as written, and a warning states how far the flange moves if exact right "
      "angles\n"
      "are meant.\n\n"
      "Examples:\n"
      "  plumbline import-urdf robot.urdf --output cell.toml\n"
      "  plumbline import-urdf robot.urdf --base base_link --tip flange \\\n"
      "      --output cell.toml\n"
      "  plumbline import-urdf config/ur10e/default_kinematics.yaml --output cell.toml\n\n"
      "Exit codes: 0 the cell was written, 1 faults in the file, 2 wrong arguments or unwritable\n"
      "output.");
  command->callback([options, &exit_code] { exit_code = RunImportUrdf(*options); });
}

}  // namespace plumbline::cli
