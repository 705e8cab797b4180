// plumbline-view: the display beside the cell.
#include <CLI/CLI.hpp>
#include <csignal>

#include "app/base/terminal/help_formatter.h"
#include "app/display/view/picture_size.h"
#include "app/display/view_process/distance_report.h"
#include "app/display/view_process/snapshot_picture.h"
#include "app/display/view_process/view_loop.h"
#include "app/version.h"

int main(int argc, char** argv) {
  std::signal(SIGPIPE, SIG_IGN);
  CLI::App app("Plumbline's display: the camera image with the bent tool, and the cell's state",
               "plumbline-view");
  app.formatter(plumbline::terminal::HelpFormatter());
  app.set_version_flag("--version", plumbline::kVersionAndBuild);
  std::string config = "/etc/plumbline/plumbline.toml";
  plumbline::display::SnapshotOptions snapshot;
  std::string size;
  app.add_option("config,--config", config, "Configuration file of the daemon")
      ->capture_default_str();
  auto* const out = app.add_option("--snapshot", snapshot.out, "Write one picture (PNG) and exit");
  app.add_option("--size", size, "With --snapshot: size of the picture, for example 1280x720")
      ->needs(out)
      ->check([](const std::string& text) {
        return plumbline::display::PictureSizeFrom(text)
                   ? ""
                   : plumbline::display::PictureSizeProblem(text);
      });
  app.add_option("--camera", snapshot.camera,
                 "With --snapshot: name of the camera to show, or both")
      ->needs(out);
  bool print_distances = false;
  auto* const distances =
      app.add_flag("--distances", print_distances, "Print distances of the object table and exit")
          ->excludes(out);
  plumbline::display::DistanceOptions distance;
  app.add_option("--name", distance.names,
                 "With --distances: name of a distance, point or object; default: all")
      ->needs(distances);
  app.add_flag("--json", snapshot.json, "Print the content or the distances as JSON");
  std::string port_file;
  app.add_option("--port-file", port_file,
                 "Write \"page PORT\" into this file whenever the page is served, for\n"
                 "scripts that let the kernel choose the port (page.port = 0)")
      ->excludes(out)
      ->excludes(distances);
  app.footer(
      "Shows the cell of the plumblined that uses the same configuration. May be\n"
      "started and stopped at any time. SIGHUP reloads the configuration, SIGTERM\n"
      "stops the program.\n\n"
      "Examples:\n"
      "  plumbline-view plumbline.toml\n"
      "  plumbline-view plumbline.toml --snapshot cell.png --size 1920x1080\n"
      "  plumbline-view plumbline.toml --distances --json\n\n"
      "Exit codes: 0 stopped by SIGTERM or SIGINT, or picture or distances written;\n"
      "1 faults in the configuration, or with --distances a value that cannot be\n"
      "measured; 2 wrong arguments, no daemon, no renderer (--snapshot), or writing\n"
      "failed.");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  if (print_distances) {
    distance.config_file = config;
    distance.json = snapshot.json;
    return plumbline::display::PrintDistances(distance);
  }
  if (snapshot.out.empty()) return plumbline::display::RunView(config, port_file);
  snapshot.config_file = config;
  if (!size.empty()) snapshot.size = *plumbline::display::PictureSizeFrom(size);
  return plumbline::display::TakeSnapshot(snapshot);
}
