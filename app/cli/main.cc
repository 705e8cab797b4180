// plumbline: the command line program.
#include <fcntl.h>
#include <glog/logging.h>
#include <poll.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <iostream>

#include "app/base/terminal/help_formatter.h"
#include "app/base/terminal/terminal_output.h"
#include "app/base/text/text.h"
#include "app/cli/commands.h"
#include "app/cli/failure.h"
#include "app/version.h"

namespace plumbline::cli {
namespace {

/// Opens descriptors 0 to 2 that the shell closed (`>&-`), so that no file opened later gets their
/// number and receives the output; printing then fails, as it should. Call first in main().
void ReserveClosedOutputs() {
  // open() returns the lowest free number, so the order matters. A write to a descriptor opened for
  // reading fails with EBADF.
  for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (fcntl(descriptor, F_GETFD) != -1) continue;
    static_cast<void>(open("/dev/null", O_RDONLY));  // NOLINT(cppcoreguidelines-pro-type-vararg)
  }
}

/// Flushes standard output. Returns true if everything was written; otherwise (full disk, closed
/// descriptor) prints an error and returns false. A reader that has exited (`| head -1`) is not an
/// error.
bool FlushStandardOutput() {
  std::cout.flush();
  if (std::cout && std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return true;
  pollfd out{.fd = STDOUT_FILENO, .events = POLLOUT, .revents = 0};
  if (poll(&out, 1, 0) == 1 && (out.revents & POLLERR) != 0) return true;  // the reader has exited
  std::cerr
      << "plumbline: standard output cannot be written; check whether the disk is full or the "
         "descriptor is closed\n";
  return false;
}

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
  const std::string nearest = text::NearestWord(word, known, kShare);
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

/// Headings of --help: the person who uses the commands. Hidden commands are started by the daemon
/// and by the package build.
constexpr const char *kCommissioning = "Commissioning commands",
                     *kProgramming = "PLC programming commands", *kMeasuring = "Measuring commands",
                     *kOperating = "Operating commands", *kHidden = "";

struct Command {
  std::string_view name;
  const char* heading;
  void (*add)(CLI::App& app, int& exit_code);
};

/// In the order of --help.
constexpr Command kCommands[] = {
    {"check", kCommissioning, AddCheckCommand},
    {"predict", kProgramming, AddPredictCommand},
    {"program", kProgramming, AddProgramCommand},
    {"path", kProgramming, AddPathCommand},
    {"diagnose", kMeasuring, AddDiagnoseCommand},
    {"effects", kMeasuring, AddEffectsCommand},
    {"plan", kMeasuring, AddPlanCommand},
    {"prior", kMeasuring, AddPriorCommand},
    {"import", kMeasuring, AddImportCommand},
    {"explain", kCommissioning, AddExplainCommand},
    {"identify-controller", kCommissioning, AddIdentifyControllerCommand},
    {"import-urdf", kCommissioning, AddImportUrdfCommand},
    {"export-urdf", kCommissioning, AddExportUrdfCommand},
    {"doctor", kCommissioning, AddDoctorCommand},
    {"distance", kProgramming, AddDistanceCommand},
    {"beam", kCommissioning, AddBeamCommand},
    {"journal", kOperating, AddJournalCommand},
    {"log", kOperating, AddLogCommand},
    {"mesh", kCommissioning, AddMeshCommand},
    {"model", kOperating, AddModelCommand},
    {"calibrate-lens", kCommissioning, AddCalibrateLensCommand},
    {"lens", kCommissioning, AddLensCommand},
    {"print", kCommissioning, AddPrintCommand},
    {"cameras", kCommissioning, AddCamerasCommand},
    {"calibrate-hand-eye", kCommissioning, AddCalibrateHandEyeCommand},
    {"registers", kProgramming, AddRegistersCommand},
    {"settings", kCommissioning, AddSettingsCommand},
    {"plant", kOperating, AddPlantCommand},
    {"snapshot", kOperating, AddSnapshotCommand},
    {"status", kOperating, AddStatusCommand},
    {"token", kCommissioning, AddTokenCommand},
    {"track", kMeasuring, AddTrackCommand},
    {"board-worker", kHidden, AddBoardWorkerCommand},
    {"completion", kHidden, AddCompletionCommand},
};

/// Adds the commands that the parser needs to know. To add the options of all commands takes longer
/// than most commands need to start.
/// @param word  the first of the command line
void AddCommands(std::string_view word, CLI::App& app, int& exit_code) {
  if (word == "--version") return;
  const auto named = std::ranges::find(kCommands, word, &Command::name);
  const bool only_named = named != std::end(kCommands) && named->add != AddCompletionCommand;
  for (const Command& command : kCommands) {
    if (only_named && &command != named) continue;
    command.add(app, exit_code);
    app.get_subcommand(std::string(command.name))->group(command.heading);
  }
}

int Run(int argc, char** argv, CLI::App& app) {
  int exit_code = kExitOk;
  auto words = WordsOf(argc, argv);
  AddCommands(words.empty() ? "" : words.back(), app, exit_code);
  try {
    app.parse(std::move(words));
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kExitOk : kExitUsage;
  } catch (const std::exception& error) {
    std::cerr << "plumbline: " << error.what() << '\n';
    return kExitUsage;
  }
  return exit_code;
}

}  // namespace
}  // namespace plumbline::cli

int main(int argc, char** argv) {
  using namespace plumbline;
  using namespace plumbline::cli;
  ReserveClosedOutputs();
  const terminal::TerminalOutput out(std::cout, STDOUT_FILENO), err(std::cerr, STDERR_FILENO);
  std::cerr << terminal::ForReading;
  FLAGS_minloglevel = google::GLOG_FATAL;  // failures of Ceres are reported by the commands
  CLI::App app("Plumbline: corrected assembly points for robots with heavy tools", "plumbline");
  app.set_version_flag("--version", kVersionAndBuild);
  app.require_subcommand(1);
  app.formatter(terminal::HelpFormatter());
  app.footer(
      "`plumbline COMMAND --help` shows the options of a command, with examples.\n\n"
      "Examples:\n"
      "  plumbline check config/cells/ur10.toml\n"
      "  plumbline diagnose cell.toml measured.csv --report report.html\n"
      "  plumbline status");
  app.failure_message(UsageFault);
  const int code = Run(argc, argv, app);
  return FlushStandardOutput() ? code : kExitUsage;
}
