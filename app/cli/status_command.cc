#include "app/cli/status_command.h"

#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <string>

#include "app/base/terminal/terminal_output.h"
#include "app/base/text/json_text.h"
#include "app/cell/view_link/view_client.h"
#include "app/cli/daemon_option.h"
#include "app/cli/daemon_registers.h"
#include "app/cli/exit_codes.h"
#include "app/cli/number_option.h"
#include "app/cli/status_json.h"
#include "app/cli/status_line.h"
#include "app/cli/status_print.h"
#include "firmware-like/result.h"

namespace plumbline::cli {
namespace {

struct StatusOptions {
  std::string host = "127.0.0.1";
  int port = 502;
  std::string state;  ///< state_directory; empty if it is not known
  bool json = false;
};

/// Prints why the robot cannot be read, which is too long for registers: from the daemon's state.
void PrintRobotProblem(const std::string& state_directory) {
  constexpr double kWait_s = 1;
  if (state_directory.empty()) return;
  cell::ViewClient client(cell::ViewSocketOf(state_directory));
  cell::View view;
  if (!client.Read(kWait_s, view) || view.state.robot_problem.empty()) return;
  PrintStatusLine(std::cout, "robot link", view.state.robot_problem);
  PrintStatusLine(std::cout, "", view.state.robot_remedy);
}

int Run(const StatusOptions& options) {
  const Result<DaemonRegisters> daemon = DaemonRegisters::Read(options.host, options.port);
  if (!daemon) {
    std::cerr << "plumbline status: " << daemon.error() << '\n';
    return kExitUsage;
  }
  if (options.json) {
    std::cout << text::JsonText(StatusJson(*daemon), 1) << '\n';
  } else {
    std::cout << terminal::ForReading;
    PrintStatus(*daemon, std::cout);
    PrintRobotProblem(options.state);
  }
  const bool alarm = static_cast<HealthSeverity>(daemon->Word("health")) == HealthSeverity::kAlarm;
  return alarm ? kExitFault : kExitOk;
}

}  // namespace

void AddStatusCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<StatusOptions>();
  CLI::App* command = app.add_subcommand("status", "Show the state of a running daemon");
  CLI::Option* host =
      command->add_option("--host", options->host, "Address of the daemon")->capture_default_str();
  CLI::Option* port = command->add_option("--port", options->port, "plc.port of the daemon")
                          ->capture_default_str()
                          ->check(WholeNumberWithin(1, 65535));
  command
      ->add_option_function<std::string>(
          "--config",
          [options](const std::string& path) {
            const DaemonPlace place = PlaceOfDaemon(path, "--port");
            options->host = place.host;
            options->port = place.port;
            options->state = place.state_directory;
          },
          kDaemonOptionText)
      ->excludes(host)
      ->excludes(port);
  command->add_flag("--json", options->json, "Print JSON");
  command->footer(
      "Reads the PLC registers over Modbus TCP; `plumbline registers` explains them.\n\n"
      "Examples:\n  plumbline status --config my-cell/plumbline.toml\n  plumbline status --port "
      "1502\n\n"
      "Exit codes: 0 no alarm, 1 the health of the cell is ALARM, 2 no daemon responds.");
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace plumbline::cli
