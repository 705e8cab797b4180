#include "app/cli/snapshot_command.h"

#include <CLI/CLI.hpp>
#include <memory>
#include <string>
#include <vector>

#include "app/cli/become_view.h"
#include "app/view/picture_size.h"

namespace plumbline {
namespace {

struct Options {
  std::string config, out, size, camera;
  bool json = false;
};

int Run(const Options& options) {
  std::vector<std::string> words = {options.config, "--snapshot", options.out};
  if (!options.size.empty()) words.insert(words.end(), {"--size", options.size});
  if (!options.camera.empty()) words.insert(words.end(), {"--camera", options.camera});
  if (options.json) words.emplace_back("--json");
  return BecomeView("snapshot", words);
}

}  // namespace

void AddSnapshotCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("snapshot", "One picture of what the monitor shows");
  command->add_option("config", options->config, "The running daemon's plumbline.toml")->required();
  command->add_option("--out", options->out, "The picture, a PNG file")
      ->required()
      ->check([](const std::string& name) {
        return name.ends_with(".png") || name == "/dev/stdout"
                   ? ""
                   : "the picture is a PNG file: its name must end in .png";
      });
  command->add_option("--size", options->size, "640x480 to 1920x1080; default 1280x720")
      ->check([](const std::string& text) {
        return PictureSizeFrom(text) ? "" : PictureSizeProblem(text);
      });
  command->add_option("--camera", options->camera,
                      "The one that is shown, by its name, or both; default: overlay.camera");
  command->add_flag("--json", options->json, "Say what is in the picture as JSON");
  command->footer(
      "Needs no screen and no plumbline-view that runs; it draws on the GPU or the processor.\n\n"
      "Example:\n  plumbline snapshot plumbline.toml --out cell.png --size 1920x1080\n\n"
      "Exit codes: 0 the picture is written, 1 faults in the configuration, 2 wrong arguments, no\n"
      "daemon, nothing to draw with, or the file cannot be written.");
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace plumbline
