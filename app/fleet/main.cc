// plumbline-fleet: what the plant is told of this cell.
#include <CLI/CLI.hpp>
#include <csignal>

#include "app/fleet/run_fleet.h"
#include "app/version.h"

int main(int argc, char** argv) {
  std::signal(SIGPIPE, SIG_IGN);
  CLI::App app("Publishes a cell's state, corrections, residuals and alarms by MQTT",
               "plumbline-fleet");
  app.set_version_flag("--version", PLUMBLINE_VERSION);
  std::string config = "/etc/plumbline/plumbline.toml";
  app.add_option("config,--config", config,
                 "The daemon's configuration, with [mqtt]; with or without --config")
      ->capture_default_str();
  app.footer(
      "Tells what the plumblined of the same configuration shows, and the measurement journal\n"
      "keeps; it may be started and ended at any time. What cannot be sent waits on the disk.\n"
      "SIGHUP reads the configuration again, SIGTERM ends.\n\n"
      "Exit codes: 0 ended by SIGTERM or SIGINT; 1 faults in the configuration, or no [mqtt];\n"
      "2 wrong arguments, or the queue cannot be used.");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  return plumbline::RunFleet(config);
}
