// plumblined: the daemon.
#include <CLI/CLI.hpp>
#include <csignal>

#include "app/base/terminal/help_formatter.h"
#include "app/cell/daemon/daemon.h"
#include "app/version.h"

int main(int argc, char** argv) {
  std::signal(SIGPIPE, SIG_IGN);  // a closed log pipe must not end the daemon
  CLI::App app("Plumbline's daemon: corrected assembly points over Modbus", "plumblined");
  app.formatter(plumbline::terminal::HelpFormatter());
  app.set_version_flag("--version", plumbline::kVersionAndBuild);
  std::string config = "/etc/plumbline/plumbline.toml";
  app.add_option("config,--config", config, "Configuration file")->capture_default_str();
  std::string port_file;
  app.add_option("--port-file", port_file,
                 "Write \"plc PORT\" into this file once the PLC is answered, for\n"
                 "scripts that let the kernel choose the port (plc.port = 0)");
  app.footer(
      "SIGHUP reloads the configuration, SIGTERM stops the daemon.\n"
      "`plumbline check FILE` reports faults of a configuration without starting a\n"
      "daemon; `plumbline status` shows the state of a running one.\n\n"
      "Example:\n  plumblined config/plumbline.toml\n\n"
      "Exit codes: 0 after SIGTERM or SIGINT, 1 faults in the configuration, 2 wrong\n"
      "arguments, or the PLC server cannot start.");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  return plumbline::cell::RunDaemon(config, port_file);
}
