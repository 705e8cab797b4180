// plumbline explain: what files are, from their bytes.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "app/base/recognition/recognition.h"
#include "app/base/terminal/terminal_output.h"
#include "app/cli/commands.h"
#include "app/cli/failure.h"
#include "drivers/files/open_failure.h"
#include "drivers/files/text_file.h"

namespace plumbline::cli {
namespace {

struct ExplainOptions {
  std::vector<std::string> files;
  bool json = false;
};

constexpr files::SizeLimit kLargestFile{std::size_t{512} << 20U, "a file to explain",
                                        "Cut off its first part, such as with head -c 1M"};

int RunExplain(const ExplainOptions& options) {
  std::vector<recognition::Recognition> all;
  int code = kExitOk;
  for (const std::string& file : options.files) {
    const Result<std::string> bytes = files::ReadFileUpTo(kLargestFile, file);
    if (!bytes) {
      std::cerr << file << ": " << files::ReadErrorText(file, bytes.error()) << '\n';
      code = kExitFault;
      continue;
    }
    all.push_back(recognition::Recognise(*bytes, file));
    const recognition::Recognition& found = all.back();
    const bool known = found.certainty == recognition::Certainty::kShown ||
                       found.certainty == recognition::Certainty::kUndecided;
    if (!known || !found.contradictions.empty()) code = kExitFault;
  }
  if (options.json) {
    std::cout << recognition::JsonOf(all);
    return code;
  }
  std::cout << terminal::ForReading;
  for (std::size_t k = 0; k < all.size(); ++k) {
    std::cout << (k > 0 ? "\n" : "") << recognition::TextOf(all[k]);
  }
  return code;
}

}  // namespace

void AddExplainCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<ExplainOptions>();
  CLI::App* command = app.add_subcommand("explain", "Say what a file is, and what to do with it");
  command->add_option("file", options->files, "Any files")->required();
  command->add_flag("--json", options->json, "Print JSON");
  command->footer(
      "Recognised are lens files (OpenCV, ROS, Kalibr, mrcal, COLMAP, ARToolKit ..), descriptions\n"
      "and tables of arms (URDF, xacro, SDF, MJCF, factory tables, DH tables), tables of "
      "trackers,\n"
      "CMMs and controllers, meshes, robot programs, boards, images, archives, recordings and\n"
      "Plumbline's own files. Each statement names the line that shows it. A contradiction within\n"
      "the file is named, such as more distortion terms than the named model has; what the file\n"
      "does not state is named, too, and never guessed.\n\n"
      "Examples:\n"
      "  plumbline explain camera.yaml\n"
      "  plumbline explain delivery/* --json\n\n"
      "Exit codes: 0 every file was recognised, 1 a file is unknown, contradicts itself or cannot\n"
      "be read, 2 wrong arguments.");
  command->callback([options, &exit_code] { exit_code = RunExplain(*options); });
}

}  // namespace plumbline::cli
