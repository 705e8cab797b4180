// plumbline-collect: stores what the cells publish in the plant's database.
#include <CLI/CLI.hpp>
#include <csignal>

#include "app/base/terminal/help_formatter.h"
#include "app/plant/collect/run_collect.h"
#include "app/plant/database/plant_config.h"
#include "app/version.h"

int main(int argc, char** argv) {
  std::signal(SIGPIPE, SIG_IGN);
  CLI::App app("Stores the messages of all cells in the plant's database", "plumbline-collect");
  app.formatter(plumbline::terminal::HelpFormatter());
  app.set_version_flag("--version", plumbline::kVersionAndBuild);
  std::string config = plumbline::plant::kPlantConfigFile;
  app.add_option("config,--config", config,
                 "The plant's configuration: [broker], [database], [collect]")
      ->capture_default_str();
  app.footer(
      "Reads from the MQTT broker what plumbline-fleet publishes at each cell, and writes it\n"
      "to PostgreSQL. A message is acknowledged to the broker when it is committed. While\n"
      "broker or database are away, the broker or the cells keep the messages. Create the\n"
      "tables first: plumbline plant init.\n\n"
      "Example:\n  plumbline-collect plant.toml\n\n"
      "Exit codes: 0 stopped by SIGTERM or SIGINT; 1 faults in the configuration;\n"
      "2 wrong arguments.");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  return plumbline::plant::RunCollect(config);
}
