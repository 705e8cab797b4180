// plumbline mesh: checks mesh files for the overlay.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <optional>
#include <string>

#include "app/base/terminal/terminal_output.h"
#include "app/base/text/json_text.h"
#include "app/cell/scene/mesh_summary.h"
#include "app/cli/commands.h"
#include "app/cli/failure.h"
#include "app/cli/file_head.h"
#include "app/cli/number_option.h"

namespace plumbline::cli {
namespace {

struct MeshOptions {
  std::string file, unit;
  bool json = false;
  cell::MeshLimits limits;
};

int RunMeshCheck(const MeshOptions& options) {
  std::optional<std::string> unit;
  double unit_m = 1;
  if (!options.unit.empty()) {
    const auto known = cell::MetresOfUnit(options.unit);
    if (!known) {
      std::cerr << fmt::format("plumbline mesh check: --unit: {} is not one of {}\n", options.unit,
                               cell::kMeshUnits);
      return kExitUsage;
    }
    unit = options.unit;
    unit_m = *known;
  }
  const auto wrong = WrongFileText(options.file, config::kWantedMesh);
  const Result<cell::MeshFile> file =
      wrong ? Result<cell::MeshFile>(Error{*wrong})
            : cell::ReadMeshFile(options.file, unit_m, options.limits);
  if (!file && options.json) {
    const nlohmann::json json = {{"schema", 1}, {"file", options.file}, {"refused", file.error()}};
    std::cout << text::JsonText(json, 2) << '\n';
  } else if (!file) {
    std::cerr << options.file << ": " << file.error() << '\n';
  } else {
    if (!options.json) std::cout << terminal::ForReading;
    std::cout << (options.json ? cell::MeshJson(*file, options.file, unit)
                               : cell::MeshText(*file, options.file, unit));
  }
  return file ? kExitOk : kExitFault;
}

}  // namespace

void AddMeshCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<MeshOptions>();
  CLI::App* mesh = app.add_subcommand("mesh", "Check mesh files for the overlay's objects");
  mesh->require_subcommand(1);
  mesh->footer("Example:\n  plumbline mesh check gripper.stl --unit mm");
  CLI::App* command =
      mesh->add_subcommand("check", "Show what a mesh file contains and whether it is usable");
  command->add_option("file", options->file, fmt::format("One of {}", cell::kMeshFormats))
      ->required();
  command->add_option("--unit", options->unit,
                      fmt::format("Length unit of the file: {}", cell::kMeshUnits));
  command
      ->add_option("--max-triangles", options->limits.triangles,
                   "Refuse a file with more triangles; at most the overlay's own limit")
      ->check(WholeNumberWithin(1, static_cast<std::int64_t>(cell::MeshLimits{}.triangles)))
      ->capture_default_str();
  command->add_flag("--json", options->json, "Print JSON");
  command->footer(fmt::format(
      "The file is read by a separate process (plumbline-mesh) that cannot open anything else, "
      "with\n"
      "at most {} MiB of memory, {} s of processor time and {:g} s in total. The limits are those "
      "of\n"
      "the overlay: {} triangles and {} MiB of file size; a file that passes here can be shown "
      "there.\n"
      "The unit is never guessed.\n\n"
      "Examples:\n  plumbline mesh check gripper.stl --unit mm\n"
      "  plumbline mesh check module.wrl --unit m --json\n\n"
      "Exit codes: 0 usable (there may be warnings), 1 refused, 2 wrong arguments.",
      options->limits.memory_bytes >> 20, options->limits.cpu_s, options->limits.wall_s,
      options->limits.triangles, options->limits.file_bytes >> 20));
  command->callback([options, &exit_code] { exit_code = RunMeshCheck(*options); });
}

}  // namespace plumbline::cli
