// plumbline snapshot: saves one picture of what the display shows.
#include <CLI/CLI.hpp>
#include <memory>
#include <string>
#include <vector>

#include "app/cli/commands.h"
#include "app/cli/exec_sibling.h"
#include "app/display/view/picture_size.h"

namespace plumbline::cli {
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
  return ExecView("snapshot", words);
}

}  // namespace

void AddSnapshotCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("snapshot", "Save a picture of what the display shows");
  command->add_option("config", options->config, "plumbline.toml of the running daemon")
      ->required();
  command->add_option("--output,--out", options->out, "PNG file to write")
      ->required()
      ->check([](const std::string& name) {
        return name.ends_with(".png") || name == "/dev/stdout"
                   ? ""
                   : "the picture is a PNG file; its name must end in .png";
      });
  command
      ->add_option("--size", options->size, "Picture size, 640x480 to 3840x2160; default: 1280x720")
      ->check([](const std::string& text) {
        return display::PictureSizeFrom(text) ? "" : display::PictureSizeProblem(text);
      });
  command->add_option("--camera", options->camera,
                      "Name of the camera to show, or \"both\"; default: overlay.camera");
  command->add_flag("--json", options->json, "Describe the content of the picture as JSON");
  command->footer(
      "Requires no display and no running plumbline-view; draws on the GPU or the processor.\n\n"
      "Example:\n  plumbline snapshot plumbline.toml --output cell.png --size 1920x1080\n\n"
      "Exit codes: 0 the picture was written, 1 faults in the configuration, 2 wrong arguments, "
      "no\n"
      "running daemon, no renderer, or the file cannot be written.");
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace plumbline::cli
