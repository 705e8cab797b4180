// plumbline-view: the monitor beside the cell.
#include <CLI/CLI.hpp>
#include <csignal>

#include "app/version.h"
#include "app/view/picture_size.h"
#include "app/view_process/distance_report.h"
#include "app/view_process/snapshot.h"
#include "app/view_process/view_loop.h"

int main(int argc, char** argv) {
  std::signal(SIGPIPE, SIG_IGN);
  CLI::App app("Plumbline's monitor: the camera's image, the bent tool over it, and how things are",
               "plumbline-view");
  app.set_version_flag("--version", PLUMBLINE_VERSION);
  std::string config = "/etc/plumbline/plumbline.toml";
  plumbline::SnapshotOptions snapshot;
  std::string size;
  app.add_option("config,--config", config, "The daemon's configuration, with or without --config")
      ->capture_default_str();
  auto* const out = app.add_option("--snapshot", snapshot.out, "Write one picture (PNG) and end");
  app.add_option("--size", size, "Of the picture, as 1280x720")
      ->needs(out)
      ->check([](const std::string& text) {
        return plumbline::PictureSizeFrom(text) ? "" : plumbline::PictureSizeProblem(text);
      });
  app.add_option("--camera", snapshot.camera, "The one that is shown, by its name, or both")
      ->needs(out);
  bool tell_distances = false;
  auto* const distances =
      app.add_flag("--distances", tell_distances, "Print distances of the object table and end")
          ->excludes(out);
  plumbline::DistanceOptions distance;
  app.add_option("--name", distance.names, "Of a distance, a point or an object; default all")
      ->needs(distances);
  app.add_flag("--json", snapshot.json, "Say what is in the picture, or the distances, as JSON");
  app.footer(
      "Shows what the plumblined of the same configuration sees and knows; it may be started and\n"
      "ended at any time. SIGHUP reads the configuration again, SIGTERM ends.\n\n"
      "Exit codes: 0 ended by SIGTERM or SIGINT, or the picture was written; 1 faults in the\n"
      "configuration; 2 wrong arguments, no daemon, or nothing to draw with (of --snapshot).");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  if (tell_distances) {
    distance.config_file = config;
    distance.json = snapshot.json;
    return plumbline::TellDistances(distance);
  }
  if (snapshot.out.empty()) return plumbline::RunView(config);
  snapshot.config_file = config;
  if (!size.empty()) snapshot.size = *plumbline::PictureSizeFrom(size);
  return plumbline::TakeSnapshot(snapshot);
}
