// plumbline calibrate-hand-eye: hand-eye calibration of a camera from images and robot poses.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>
#include <memory>

#include "app/base/config/cell_reader.h"
#include "app/base/config/required_file.h"
#include "app/base/target/board.h"
#include "app/base/terminal/terminal_output.h"
#include "app/cli/board_option.h"
#include "app/cli/commands.h"
#include "app/cli/failure.h"
#include "app/cli/lens_option.h"
#include "app/cli/number_option.h"
#include "app/cli/output_file.h"
#include "app/cli/progress.h"
#include "app/vision/hand_eye/hand_eye_json.h"
#include "app/vision/hand_eye/target_views.h"
#include "drivers/camera/image_file.h"
#include "drivers/camera/image_folder.h"
#include "drivers/files/open_failure.h"

namespace plumbline::cli {
namespace {

struct CalibrateHandEyeOptions {
  std::string images, poses, intrinsics, cell, bodies, body, setup = "eye-to-hand", json;
  std::string tag_family = "36h11";
  BoardOptions board;
  double acceptable_mm = 0.5;
  bool free_lens = false, free_size = false, free_joints = false, force = false, quiet = false;
};

/// Everything that the command reads.
struct Inputs {
  std::optional<model::CellModel> cell;
  std::map<std::string, vision::RobotPose> poses;
  target::TagDatabase database;
  vision::Target target;
  std::vector<std::string> names;
};

// The Read functions print the reason if they fail and return false.

bool ReadTarget(const CalibrateHandEyeOptions& options, Inputs& inputs) {
  if (options.bodies.empty()) {
    inputs.target.board = BoardOf(options.board);
    if (const std::string problem = BoardOptionProblem(inputs.target.board); !problem.empty()) {
      std::cerr << "plumbline calibrate-hand-eye: " << problem << '\n';
      return false;
    }
    return true;
  }
  auto family = target::TagFamilyOfName(options.tag_family);
  if (!family) {
    std::cerr << "plumbline calibrate-hand-eye: --tag-family: " << family.error() << '\n';
    return false;
  }
  inputs.target.family = std::move(family).value();
  auto database = ReadBodies(options.bodies);
  if (!database) return false;
  inputs.database = std::move(*database);
  for (const target::Body& body : inputs.database.bodies) {
    if (body.name == options.body) inputs.target.body = &body;
  }
  if (inputs.target.body == nullptr) {
    Fail(fmt::format("{}: has no body \"{}\"; select one with --body", options.bodies,
                     options.body));
    return false;
  }
  return true;
}

bool ReadPoses(const CalibrateHandEyeOptions& options, Inputs& inputs) {
  config::FaultList faults;
  if (!options.cell.empty()) {
    inputs.cell = config::ReadCell(options.cell, faults);
    if (!inputs.cell) {
      std::cerr << config::FaultsText(faults);
      return false;
    }
    faults = {};
  }
  std::optional<std::map<std::string, vision::RobotPose>> poses;
  if (const auto text = config::ReadRequiredFile(options.poses, faults, files::kTableSize)) {
    poses = vision::RobotPosesFromCsv(
        *text, options.poses, inputs.cell ? inputs.cell->robot.joints : std::vector<model::Joint>{},
        faults);
  }
  std::cerr << config::FaultsText(faults);
  if (!poses) return false;
  inputs.poses = *poses;
  const bool joints = !poses->empty() && poses->begin()->second.q.size() > 0;
  if (options.free_joints && !joints) {
    Fail(fmt::format("{}: --free-joints requires joint columns (q1_deg ..) and --cell",
                     options.poses));
    return false;
  }
  return true;
}

bool ReadNames(const CalibrateHandEyeOptions& options, Inputs& inputs) {
  const auto names = camera::ListImageNames(options.images);
  if (!names) {
    Fail(
        fmt::format("{}: {}", options.images, files::ReadErrorText(options.images, names.error())));
    return false;
  }
  inputs.names = *names;
  return true;
}

int Run(const CalibrateHandEyeOptions& options) {
  if (!options.json.empty() && options.json != "-") {
    for (const std::string& input :
         {options.poses, options.intrinsics, options.bodies, options.cell}) {
      if (!SameFile(options.json, input)) continue;
      std::cerr << fmt::format(
          "plumbline calibrate-hand-eye: --json would overwrite the input {}; choose another "
          "file\n",
          input);
      return kExitUsage;
    }
    if (!CanWriteOutput(options.json, "--json")) return kExitUsage;
  }
  Inputs inputs;
  const auto lens = ReadUsableLens(options.intrinsics, options.force);
  if (!lens || !ReadTarget(options, inputs) || !ReadPoses(options, inputs) ||
      !ReadNames(options, inputs))
    return kExitFault;
  Interruption interruption;
  Progress progress(std::cerr, options.quiet);
  std::size_t seen = 0;
  vision::TargetViews found =
      vision::FindTargets(options.images, inputs.names, inputs.poses, inputs.target, *lens, [&] {
        progress.ShowCount(seen++, inputs.names.size(), "images");
        return Interruption::Requested();
      });
  progress.Clear();
  if (Interruption::Requested()) return Interrupted();
  if (const Result<void> codecs = camera::CheckImageCodecs(); !codecs) return Fail(codecs.error());
  vision::HandEyeOptions how;
  how.setup = options.setup == "eye-in-hand" ? vision::HandEyeSetup::kEyeInHand
                                             : vision::HandEyeSetup::kEyeToHand;
  how.image = lens->size;
  how.free_lens = options.free_lens;
  how.free_size = options.free_size;
  how.free_joints = options.free_joints;
  const std::vector<target::BoardTurn> turns = target::SymmetriesOf(inputs.target.board);
  how.half_turn_symmetric =
      inputs.target.body == nullptr &&
      std::ranges::find(turns, 2, &target::BoardTurn::quarters) != turns.end();
  how.acceptable_m = 1e-3 * options.acceptable_mm;
  std::optional<kinematics::Chain> chain;
  if (inputs.cell) chain.emplace(inputs.cell->robot);
  how.chain = chain ? &*chain : nullptr;
  vision::HandEye answer = vision::CalibrateHandEye(std::move(found.views), *lens, how);
  answer.refused.insert(answer.refused.begin(), found.refused.begin(), found.refused.end());
  const std::string json =
      vision::HandEyeJson(answer, how, inputs.cell ? &inputs.cell->robot.X_WB : nullptr);
  if (!interruption.Disarm()) return Interrupted();
  if (!options.json.empty() && !PrintOrWriteOutput(options.json, json, "--json")) return kExitUsage;
  if (!options.quiet)
    (options.json == "-" ? std::cerr : std::cout)
        << terminal::ForReading << vision::HandEyeText(answer, how);
  return kExitOk;
}

}  // namespace

void AddCalibrateHandEyeCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<CalibrateHandEyeOptions>();
  CLI::App* command = app.add_subcommand(
      "calibrate-hand-eye",
      "Determine the pose of a camera, in the cell or on the flange, from robot poses");
  command->add_option("--images", options->images, "Folder of images")->required();
  command
      ->add_option("--poses", options->poses,
                   "CSV table: image and flange pose, or image and joints together with --cell")
      ->required();
  command
      ->add_option("--intrinsics", options->intrinsics,
                   "Lens calibration, LENS.json from plumbline calibrate-lens")
      ->required();
  command
      ->add_option("--setup", options->setup,
                   "eye-to-hand: camera fixed in the cell; eye-in-hand: camera on the flange")
      ->capture_default_str()
      ->check(CLI::IsMember({"eye-to-hand", "eye-in-hand"}));
  AddBoardOptions(*command, options->board);
  command->add_option("--bodies", options->bodies,
                      "TOML file with tag bodies, to use one of them instead of a board");
  command->add_option("--body", options->body, "Name of the body to use as target");
  command->add_option("--tag-family", options->tag_family, "Tag family of the bodies")
      ->capture_default_str();
  command->add_option("--cell", options->cell,
                      "CELL.toml, required for joints and for the camera pose in the cell");
  command->add_flag("--free-lens", options->free_lens,
                    "Also estimate the lens, with its calibration as prior");
  command->add_flag("--free-size", options->free_size, "Also estimate the size of the target");
  command->add_flag("--free-joints", options->free_joints, "Also estimate joint offsets");
  command
      ->add_option("--acceptable-mm", options->acceptable_mm,
                   "Largest accepted position deviation of a point seen by the camera")
      ->capture_default_str()
      ->check(NumberWithin(0.001, 1000));
  command->add_option("--json", options->json, "Write the result as JSON; - is standard output");
  command->add_flag("--force", options->force, "Use a lens whose calibration was refused");
  command->add_flag("--quiet", options->quiet, "Print no summary");
  command->footer(
      "Take 12 to 30 images with the robot at rest and the flange tilted by 20 to 40 degrees in "
      "all\n"
      "directions. A refused result also has exit code 0, with \"accepted\": false and the "
      "remedy.\n\n"
      "Examples:\n"
      "  plumbline calibrate-hand-eye --images frames --poses poses.csv \\\n"
      "      --intrinsics lens.json --board 9x6 --square-mm 30 --json handeye.json\n"
      "  plumbline calibrate-hand-eye --images frames --poses joints.csv \\\n"
      "      --cell cell.toml --intrinsics lens.json --bodies bodies.toml \\\n"
      "      --body gripper --free-joints");
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace plumbline::cli
