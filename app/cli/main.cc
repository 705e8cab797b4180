// plumbline: the command line.
#include <CLI/CLI.hpp>
#include <iostream>

#include "app/cli/beam_command.h"
#include "app/cli/check_command.h"
#include "app/cli/exit_codes.h"
#include "app/cli/predict_command.h"
#include "app/cli/registers_command.h"
#include "app/cli/status_command.h"
#include "app/version.h"

int main(int argc, char** argv) {
  using namespace plumbline;
  CLI::App app("Plumbline: corrected assembly points for robots with heavy tools", "plumbline");
  app.set_version_flag("--version", PLUMBLINE_VERSION);
  app.require_subcommand(1);
  app.failure_message(CLI::FailureMessage::help);
  int exit_code = kExitOk;
  AddCheckCommand(app, exit_code);
  AddPredictCommand(app, exit_code);
  AddBeamCommand(app, exit_code);
  AddRegistersCommand(app, exit_code);
  AddStatusCommand(app, exit_code);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kExitOk : kExitUsage;
  } catch (const std::exception& error) {
    std::cerr << "plumbline: " << error.what() << '\n';
    return kExitUsage;
  }
  return exit_code;
}
