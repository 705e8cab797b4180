// plumblined: the daemon.
#include <CLI/CLI.hpp>
#include <csignal>

#include "app/daemon/daemon.h"
#include "app/version.h"

int main(int argc, char** argv) {
  std::signal(SIGPIPE, SIG_IGN);  // a log that nobody reads any more is no reason to die
  CLI::App app("Plumbline's daemon: corrected assembly points over Modbus", "plumblined");
  app.set_version_flag("--version", PLUMBLINE_VERSION);
  std::string config = "/etc/plumbline/plumbline.toml";
  app.add_option("config,--config", config, "The configuration, with or without --config")
      ->capture_default_str();
  app.footer(
      "Ends with 0 on SIGTERM or SIGINT, 1 where the configuration has faults, 2 on wrong\n"
      "arguments or where the PLC side cannot be served.\n"
      "SIGHUP reads the configuration again, SIGTERM ends.\n"
      "`plumbline check FILE` tells the faults of a configuration without a daemon;\n"
      "`plumbline status` reads a running one.\n\n"
      "Example:\n  plumblined config/plumbline.toml");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  return plumbline::RunDaemon(config);
}
