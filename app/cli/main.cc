// plumbline: the command line program.
#include <glog/logging.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>

#include "app/base/terminal/help_formatter.h"
#include "app/base/terminal/terminal_output.h"
#include "app/base/text/nearest_word.h"
#include "app/cli/beam_command.h"
#include "app/cli/board_worker_command.h"
#include "app/cli/calibrate_hand_eye_command.h"
#include "app/cli/calibrate_lens_command.h"
#include "app/cli/cameras_command.h"
#include "app/cli/check_command.h"
#include "app/cli/completion_command.h"
#include "app/cli/diagnose_command.h"
#include "app/cli/distance_command.h"
#include "app/cli/doctor_command.h"
#include "app/cli/exit_codes.h"
#include "app/cli/export_urdf_command.h"
#include "app/cli/import_command.h"
#include "app/cli/import_urdf_command.h"
#include "app/cli/journal_command.h"
#include "app/cli/lens_command.h"
#include "app/cli/log_command.h"
#include "app/cli/mesh_command.h"
#include "app/cli/model_command.h"
#include "app/cli/plan_command.h"
#include "app/cli/predict_command.h"
#include "app/cli/print_command.h"
#include "app/cli/registers_command.h"
#include "app/cli/settings_command.h"
#include "app/cli/snapshot_command.h"
#include "app/cli/standard_output.h"
#include "app/cli/status_command.h"
#include "app/cli/token_command.h"
#include "app/cli/track_command.h"
#include "app/version.h"

namespace {

/// Replaces the first occurrence of `from`. @return false if there is none
bool Replace(std::string& text, std::string_view from, std::string_view to) {
  const auto at = text.find(from);
  if (at == std::string::npos) return false;
  text.replace(at, from.size(), to);
  return true;
}

/// Rewords an error message of the CLI11 parser; messages that are not recognised stay unchanged.
std::string Reworded(std::string what) {
  if (what == "A subcommand is required") return "the command is missing";
  if (what.rfind("Could not convert: ", 0) == 0) {  // --after = x
    what.erase(0, what.find(": ") + 2);
    Replace(what, " = ", ": ");
    return what + " is not a number";
  }
  if (Replace(what, " is required", " is missing") || what.find(" requires ") != what.npos) {
    return what;
  }
  if (Replace(what, " excludes ", " and ")) return what + " cannot be combined";
  const auto value = what.find(": ");
  if (value != std::string::npos && what.find("required", value) != std::string::npos &&
      what.rfind(" missing") == what.size() - 8) {  // --port: 1 required INT missing
    return what.substr(0, value) + ": its value is missing";
  }
  if (const auto list = what.find(" not in {"); list != std::string::npos && what.back() == '}') {
    std::string words;
    for (const char c : what.substr(list + 9, what.size() - list - 10)) {
      words += c == ',' ? std::string(", ") : std::string(1, c);
    }
    return what.substr(0, list) + " is not one of " + words;
  }
  return what;
}

/// "; did you mean \"status\"?", or nothing if no word is near.
std::string Suggestion(const std::string& word, const std::vector<std::string>& known) {
  constexpr double kShare = 0.4;
  constexpr std::size_t kMinLength = 4;  // of shorter words, any is near
  if (word.size() < kMinLength) return "";
  const std::string nearest = plumbline::text::NearestWord(word, known, kShare);
  return nearest.empty() ? "" : "; did you mean \"" + nearest + "\"?";
}

/// The nearest command or option of an app to a word that is neither.
std::string SuggestionFor(const CLI::App& app, const std::string& word) {
  std::vector<std::string> known;
  if (word.starts_with("--")) {
    for (const CLI::Option* option : app.get_options()) {
      for (const std::string& name : option->get_lnames()) known.push_back("--" + name);
    }
  } else {
    for (const CLI::App* command :
         app.get_subcommands([](const CLI::App* one) { return !one->get_group().empty(); })) {
      known.push_back(command->get_name());
    }
  }
  return Suggestion(word.substr(0, word.find('=')), known);
}

/// One-line message of a usage error that refers to the help of the command.
std::string UsageFault(const CLI::App* app, const CLI::Error& error) {
  std::string command = "plumbline", what = Reworded(error.what());
  const CLI::App* const whole = app;
  for (auto given = app->get_subcommands(); !given.empty(); given = app->get_subcommands()) {
    app = given.front();
    command += " " + app->get_name();
  }
  const bool takes_commands = !app->get_subcommands([](const CLI::App*) { return true; }).empty();
  const auto unknown = app->remaining().empty() ? whole->remaining() : app->remaining();
  if (takes_commands && !unknown.empty()) {
    what = "\"" + unknown.front() + "\" is not a command" + SuggestionFor(*app, unknown.front());
  } else if (!unknown.empty() &&
             error.get_exit_code() == static_cast<int>(CLI::ExitCodes::ExtrasError)) {
    what = unknown.front() + " is not a known argument" + SuggestionFor(*app, unknown.front());
  }
  return command + ": " + what + "; see " + command + " --help\n";
}

/// Command line words in reverse order, as CLI11 expects them. `plumbline help COMMAND` becomes
/// `plumbline COMMAND --help`.
std::vector<std::string> WordsOf(int argc, char** argv) {
  std::vector<std::string> words(argv + 1, argv + argc);
  if (!words.empty() && words.front() == "help") {
    words.erase(words.begin());
    words.emplace_back("--help");
  }
  std::reverse(words.begin(), words.end());
  return words;
}

/// Sorts the commands of --help by the person who uses them.
void GroupCommands(CLI::App& app) {
  struct Group {
    const char* heading;
    std::vector<std::string_view> commands;
  };
  const Group groups[] = {
      {"Commissioning commands",
       {"check", "doctor", "settings", "import-urdf", "export-urdf", "mesh", "beam", "cameras",
        "print", "calibrate-lens", "calibrate-hand-eye", "lens", "token"}},
      {"PLC programming commands", {"registers", "predict", "distance"}},
      {"Measuring commands", {"plan", "import", "diagnose", "track"}},
      {"Operating commands", {"status", "log", "journal", "model", "snapshot"}}};
  for (CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    if (command->get_group().empty()) continue;
    for (const Group& group : groups) {
      const auto& names = group.commands;
      if (std::find(names.begin(), names.end(), command->get_name()) != names.end()) {
        command->group(group.heading);
      }
    }
  }
}

int RunCommand(CLI::App& app, int argc, char** argv, const int& exit_code) {
  using namespace plumbline;
  using namespace plumbline::cli;
  try {
    app.parse(WordsOf(argc, argv));
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kExitOk : kExitUsage;
  } catch (const std::exception& error) {
    std::cerr << "plumbline: " << error.what() << '\n';
    return kExitUsage;
  }
  return exit_code;
}

}  // namespace

int main(int argc, char** argv) {
  using namespace plumbline;
  using namespace plumbline::cli;
  ReserveClosedOutputs();
  const terminal::TerminalOutput out(std::cout, STDOUT_FILENO), err(std::cerr, STDERR_FILENO);
  std::cerr << terminal::ForReading;
  FLAGS_minloglevel = google::GLOG_FATAL;  // failures of Ceres are reported by the commands
  CLI::App app("Plumbline: corrected assembly points for robots with heavy tools", "plumbline");
  app.set_version_flag("--version", PLUMBLINE_VERSION);
  app.require_subcommand(1);
  app.formatter(terminal::HelpFormatter());
  app.footer(
      "`plumbline COMMAND --help` shows the options of a command, with examples.\n\n"
      "Examples:\n"
      "  plumbline check config/cells/ur10.toml\n"
      "  plumbline diagnose cell.toml measured.csv --report report.html\n"
      "  plumbline status");
  app.failure_message(UsageFault);
  int exit_code = kExitOk;
  AddCheckCommand(app, exit_code);
  AddPredictCommand(app, exit_code);
  AddDiagnoseCommand(app, exit_code);
  AddPlanCommand(app, exit_code);
  AddImportCommand(app, exit_code);
  AddImportUrdfCommand(app, exit_code);
  AddExportUrdfCommand(app, exit_code);
  AddDoctorCommand(app, exit_code);
  AddDistanceCommand(app, exit_code);
  AddBeamCommand(app, exit_code);
  AddJournalCommand(app, exit_code);
  AddLogCommand(app, exit_code);
  AddMeshCommand(app, exit_code);
  AddModelCommand(app, exit_code);
  AddCalibrateLensCommand(app, exit_code);
  AddLensCommand(app, exit_code);
  AddPrintCommand(app, exit_code);
  AddCamerasCommand(app, exit_code);
  AddCalibrateHandEyeCommand(app, exit_code);
  AddRegistersCommand(app, exit_code);
  AddSettingsCommand(app, exit_code);
  AddSnapshotCommand(app, exit_code);
  AddStatusCommand(app, exit_code);
  AddTokenCommand(app, exit_code);
  AddTrackCommand(app, exit_code);
  AddBoardWorkerCommand(app, exit_code);
  AddCompletionCommand(app, exit_code);
  GroupCommands(app);
  const int code = RunCommand(app, argc, argv, exit_code);
  return FlushStandardOutput() ? code : kExitUsage;
}
