#include "app/cli/status_command.h"

#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <string>

#include "app/cli/daemon_registers.h"
#include "app/cli/exit_codes.h"
#include "app/cli/number_option.h"
#include "app/cli/status_json.h"
#include "app/cli/status_print.h"
#include "app/cli/terminal_output.h"
#include "app/text/json_text.h"
#include "firmware-like/result.h"

namespace plumbline::cli {
namespace {

struct StatusOptions {
  std::string host = "127.0.0.1";
  int port = 502;
  bool json = false;
};

int Run(const StatusOptions& options) {
  const Result<DaemonRegisters> daemon = DaemonRegisters::Read(options.host, options.port);
  if (!daemon) {
    std::cerr << "plumbline status: " << daemon.error() << '\n';
    return kExitUsage;
  }
  if (options.json) {
    std::cout << text::JsonText(StatusJson(*daemon), 1) << '\n';
  } else {
    std::cout << ForReading;
    PrintStatus(*daemon, std::cout);
  }
  const bool alarm = static_cast<HealthSeverity>(daemon->Word("health")) == HealthSeverity::kAlarm;
  return alarm ? kExitFault : kExitOk;
}

}  // namespace

void AddStatusCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<StatusOptions>();
  CLI::App* command = app.add_subcommand("status", "Show the state of a running daemon");
  command->add_option("--host", options->host, "Address of the daemon")->capture_default_str();
  command->add_option("--port", options->port, "plc.port of the daemon")
      ->capture_default_str()
      ->check(WholeNumberWithin(1, 65535));
  command->add_flag("--json", options->json, "Print JSON");
  command->footer(
      "Reads the PLC registers over Modbus TCP; `plumbline registers` explains them.\n\n"
      "Example:\n  plumbline status --port 1502\n\n"
      "Exit codes: 0 no alarm, 1 the health of the cell is ALARM, 2 no daemon responds.");
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace plumbline::cli
