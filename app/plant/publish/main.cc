// plumbline-fleet: publishes the cell's state to the plant by MQTT.
#include <CLI/CLI.hpp>
#include <csignal>

#include "app/base/terminal/help_formatter.h"
#include "app/plant/publish/run_fleet.h"
#include "app/version.h"

int main(int argc, char** argv) {
  std::signal(SIGPIPE, SIG_IGN);
  CLI::App app("Publishes a cell's state, corrections, residuals and alarms by MQTT",
               "plumbline-fleet");
  app.formatter(plumbline::terminal::HelpFormatter());
  app.set_version_flag("--version", plumbline::kVersionAndBuild);
  std::string config = "/etc/plumbline/plumbline.toml";
  app.add_option("config,--config", config, "The daemon's configuration, with [mqtt]")
      ->capture_default_str();
  app.footer(
      "Publishes the state of the plumblined that uses the same configuration, and the\n"
      "probes of its measurement journal. May be started and stopped at any time.\n"
      "Messages that cannot be sent are queued on disk. SIGHUP reloads the\n"
      "configuration, SIGTERM stops the program.\n\n"
      "Example:\n  plumbline-fleet plumbline.toml\n\n"
      "Exit codes: 0 stopped by SIGTERM or SIGINT; 1 faults in the configuration, or\n"
      "no [mqtt]; 2 wrong arguments, or the queue cannot be used.");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  return plumbline::plant::RunFleet(config);
}
