#include "app/cli/snapshot_command.h"

#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <memory>
#include <vector>

#include "app/cli/exit_codes.h"
#include "app/view/picture_size.h"

namespace plumbline {
namespace {

struct Options {
  std::string config, out, size, camera;
  bool json = false;
};

/// Becomes plumbline-view, which lies beside this program: it alone is linked with what draws.
int Run(const Options& options) {
  std::error_code error;
  const auto self = std::filesystem::read_symlink("/proc/self/exe", error);
  const std::string program =
      error ? "/usr/bin/plumbline-view" : (self.parent_path() / "plumbline-view").string();
  std::vector<std::string> words = {program, options.config, "--snapshot", options.out};
  if (!options.size.empty()) words.insert(words.end(), {"--size", options.size});
  if (!options.camera.empty()) words.insert(words.end(), {"--camera", options.camera});
  if (options.json) words.emplace_back("--json");
  std::vector<char*> arguments;
  arguments.reserve(words.size() + 1);
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  execv(program.c_str(), arguments.data());
  std::cerr << fmt::format("plumbline snapshot: {}: {}; it is installed beside this program\n",
                           program, std::strerror(errno));
  return kExitUsage;
}

}  // namespace

void AddSnapshotCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("snapshot", "One picture of what the monitor shows");
  command->add_option("config", options->config, "The running daemon's plumbline.toml")->required();
  command->add_option("--out", options->out, "The picture, a PNG file")->required();
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
