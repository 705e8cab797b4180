// plumbline-sparkplug: presents the cells of a plant as Sparkplug B edge nodes.
#include <CLI/CLI.hpp>
#include <csignal>

#include "app/base/terminal/help_formatter.h"
#include "app/plant/sparkplug/run_sparkplug.h"
#include "app/version.h"

int main(int argc, char** argv) {
  std::signal(SIGPIPE, SIG_IGN);
  CLI::App app("Presents the cells of a plant as Sparkplug B edge nodes", "plumbline-sparkplug");
  app.formatter(plumbline::terminal::HelpFormatter());
  app.set_version_flag("--version", plumbline::kVersionAndBuild);
  std::string config = "/etc/plumbline/plant.toml";
  app.add_option("config,--config", config, "The plant's configuration, with [broker]")
      ->capture_default_str();
  app.footer(
      "Subscribes to what plumbline-fleet publishes and publishes it as NBIRTH, NDATA\n"
      "and NDEATH, for hosts that know Sparkplug B 3.0. Answers their requests for a\n"
      "rebirth by itself; a cell receives nothing. SIGHUP reloads the configuration,\n"
      "SIGTERM stops the program.\n\n"
      "Example:\n  plumbline-sparkplug plant.toml\n\n"
      "Exit codes: 0 stopped by SIGTERM or SIGINT; 1 faults in the configuration;\n"
      "2 wrong arguments.");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  return plumbline::plant::RunSparkplug(config);
}
