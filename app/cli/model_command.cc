// plumbline model: lists, proposes, applies and rolls back versions of the cell's model.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "app/base/config/cell_reader.h"
#include "app/base/config/daemon_config.h"
#include "app/base/config/required_file.h"
#include "app/base/terminal/terminal_output.h"
#include "app/base/text/json_text.h"
#include "app/cell/model_store/daemon_signal.h"
#include "app/cell/model_store/model_change.h"
#include "app/cell/model_store/model_json.h"
#include "app/cell/model_store/model_store.h"
#include "app/cell/model_store/usable_model.h"
#include "app/cli/commands.h"
#include "app/cli/failure.h"
#include "app/cli/model_moves.h"
#include "app/cli/state_subcommand.h"
#include "drivers/files/open_failure.h"
#include "drivers/files/text_file.h"

namespace plumbline::cli {
namespace {

// Output of `plumbline model list` and `show`: versions of the cell's model and their facts.

std::string MarkOf(int number, const cell::ModelState& state) {
  std::vector<std::string> marks;
  if (number == state.applied) marks.emplace_back("APPLIED");
  if (number == state.proposed) marks.emplace_back("proposed");
  if (number == state.declared) marks.emplace_back("declared");
  if (state.set_aside && number == state.set_aside->version) marks.emplace_back("SET ASIDE");
  return fmt::format("{}", fmt::join(marks, ", "));
}

std::string Millimetres(const std::optional<double>& value) {
  return value ? fmt::format("{:.3f}", *value) : "-";
}

nlohmann::json VersionJson(const cell::ModelVersion& version, const cell::ModelState& state) {
  nlohmann::json json = text::JsonOrNull(cell::JsonFrom(version.facts));
  json["version"] = version.number;
  json["applied"] = version.number == state.applied;
  json["proposed"] = version.number == state.proposed;
  json["declared"] = version.number == state.declared;
  const bool aside = state.set_aside && version.number == state.set_aside->version;
  json["set_aside"] = aside;
  if (aside) json["set_aside_because"] = state.set_aside->changes;
  return json;
}

/// Table with one line for each version.
void PrintVersions(const std::vector<cell::ModelVersion>& versions, const cell::ModelState& state,
                   std::ostream& out) {
  out << fmt::format("{:>7}  {:<20} {:<9} {:<9} {:>6} {:>6}\n", "version", "date", "origin",
                     "verdict", "before", "after")
      << fmt::format("{:>7}  {:<20} {:<9} {:<9} {:>6} {:>6}\n", "", "", "", "", "mm", "mm");
  for (const auto& [number, facts] : versions) {
    const std::string mark = MarkOf(number, state);
    out << fmt::format("{:>7}  {:<20} {:<9} {:<9} {:>6} {:>6}{}\n", number, facts.date,
                       NameOf(facts.origin), facts.verdict.empty() ? "-" : facts.verdict,
                       Millimetres(facts.rms_before_mm), Millimetres(facts.rms_after_mm),
                       mark.empty() ? "" : "  " + mark);
  }
}

/// The facts of a version, as comments that may precede its text.
void PrintVersion(const cell::ModelVersion& version, const cell::ModelState& state,
                  const std::string& report_file, std::ostream& out) {
  const auto& [number, facts] = version;
  out << fmt::format("# version {}  {}\n# {}, {}, from {}\n", number, MarkOf(number, state),
                     NameOf(facts.origin), facts.date, facts.from);
  if (facts.based_on) out << fmt::format("# based on version {}\n", *facts.based_on);
  if (!facts.verdict.empty()) {
    out << fmt::format("# {}: {}; held out {} -> {} mm\n", facts.verdict,
                       fmt::join(facts.effects, ", "), Millimetres(facts.rms_before_mm),
                       Millimetres(facts.rms_after_mm));
  }
  for (const std::string& implausible : facts.implausible) {
    out << "# implausible for a healthy machine: " << implausible << '\n';
  }
  if (facts.discrepancy_share) {
    out << fmt::format("# {:.0f} % of the correction is from the discrepancy model\n",
                       100 * *facts.discrepancy_share);
  }
  if (facts.change_mm) {
    out << fmt::format("# moves the predicted tip by up to {:.3f} mm\n", *facts.change_mm);
  }
  if (facts.points_change_mm) {
    out << fmt::format("# moved the configured points by up to {:.3f} mm when it was fitted\n",
                       *facts.points_change_mm);
  }
  if (!facts.report.empty()) {
    out << fmt::format("# report: {}\n", report_file);
  }
}

/// Explains why an applied version is not in force, and lists the keys that changed.
void PrintSetAside(const cell::ModelState& state, const std::string& state_directory,
                   std::ostream& out) {
  if (!state.set_aside) return;
  out << '\n' << cell::SupersededText(state, state_directory) << '\n';
  for (const std::string& change : state.set_aside->changes) out << "  " << change << '\n';
}

struct ModelOptions {
  std::string state = config::kDefaultStateDirectory;
  std::string file, diagnosis, report, config;
  std::optional<int> number;
  bool json = false, force = false;
};

/// Opens the store; while waiting for its lock, prints who holds it to standard error.
Result<cell::ModelStore> OpenReporting(const std::string& state_directory) {
  Result<cell::ModelStore> store = cell::ModelStore::Open(state_directory);
  if (!store) return store;
  store.value().OnLockWait([](const std::string& what) { std::cerr << what << std::endl; });
  return store;
}

/// Opens the store of an existing state directory; does not create one.
Result<cell::ModelStore> ExistingStore(const ModelOptions& options) {
  if (!std::filesystem::exists(options.state + "/models")) {
    return Error{
        fmt::format("{}/models: the model store does not exist yet; the daemon creates it at its "
                    "first start. Or give another --state",
                    options.state)};
  }
  return OpenReporting(options.state);
}

/// Prints an error if there is no such version.
bool Exists(const cell::ModelStore& store, int number) {
  std::error_code unknown;
  if (std::filesystem::exists(store.ModelFile(number), unknown)) return true;
  std::cerr << fmt::format("no version {}; `plumbline model list` lists all versions\n", number);
  return false;
}

int List(const ModelOptions& options) {
  const Result<cell::ModelStore> store = ExistingStore(options);
  if (!store) return Fail(store.error(), kExitFault);
  const Result<cell::ModelState> known = store->State();
  const auto versions = store->Versions();
  if (!versions) return Fail(versions.error(), kExitFault);
  // If the state cannot be read, a person must choose a version: list them anyway, without marks.
  const cell::ModelState state = known ? *known : cell::ModelState{};
  if (options.json) {
    nlohmann::json list = nlohmann::json::array();
    for (const cell::ModelVersion& version : *versions) {
      nlohmann::json one = VersionJson(version, state);
      for (const char* mark : {"applied", "proposed", "declared", "set_aside"}) {
        if (!known) one[mark] = nullptr;
      }
      list.push_back(std::move(one));
    }
    std::cout << text::JsonText(list, 1) << '\n';
    return known ? kExitOk : Fail(known.error(), kExitFault);
  }
  std::cout << terminal::ForReading;
  PrintVersions(*versions, state, std::cout);
  PrintSetAside(state, options.state, std::cout);
  return known ? kExitOk : Fail(known.error(), kExitFault);
}

int Show(const ModelOptions& options) {
  const Result<cell::ModelStore> store = ExistingStore(options);
  if (!store) return Fail(store.error(), kExitFault);
  const Result<cell::ModelState> state = store->State();
  if (!state) return Fail(state.error(), kExitFault);
  const int number = options.number.value_or(state->applied);
  if (!Exists(*store, number)) return kExitFault;
  const Result<cell::ModelFacts> facts = store->Facts(number);
  if (!facts) return Fail(facts.error(), kExitFault);
  const Result<std::string> text = store->Text(number);
  if (!text) return Fail(text.error(), kExitFault);
  if (options.json) {
    nlohmann::json json = VersionJson({number, *facts}, *state);
    json["file"] = store->ModelFile(number);
    std::cout << text::JsonText(json, 1) << '\n';
    return kExitOk;
  }
  PrintVersion({number, *facts}, *state, store->ReportFile(number), std::cout);
  std::cout << *text;
  return kExitOk;
}

/// The model in force; nullopt if there is none yet or it cannot be read.
std::optional<model::CellModel> ModelInForce(const cell::ModelStore& store) {
  const Result<cell::ModelState> state = store.State();
  if (!state || state->applied == 0) return std::nullopt;
  const Result<std::string> text = store.Text(state->applied);
  config::FaultList ignored;
  return text ? config::CellFromText(*text, store.ModelFile(state->applied), ignored)
              : std::nullopt;
}

/// Prints how far a model moves the points compared with the model in force, and the objections.
/// @return the objections, or an error if the given configuration cannot be used
Result<std::vector<std::string>> PrintMoves(const ModelOptions& options,
                                            const model::CellModel& in_force,
                                            const model::CellModel& cell) {
  const Result<ModelMoves> moves = MovesOfPoints(options.state, options.config, in_force, cell);
  if (!moves) return moves.failure();
  std::cerr << moves->text;
  for (const std::string& objection : moves->objections) {
    std::cerr << fmt::format("warning: {}\n", objection);
  }
  return moves->objections;
}

/// Prints how far a model moves the points compared with the model in force.
/// @param applying  it comes into force now, so that objections count
/// @return why it must not: it describes another arm, there are objections to its moves, or the
///         given configuration cannot be used; --force accepts the first two
Result<void> MayReplaceModelInForce(const ModelOptions& options, const cell::ModelStore& store,
                                    const model::CellModel& cell, bool applying) {
  const std::optional<model::CellModel> in_force = ModelInForce(store);
  if (!in_force) {
    std::cerr << "how far the points move is unknown: there is no model in force to compare with\n";
    return {};
  }
  if (const auto why = cell::DifferentArmReason(*in_force, cell)) {
    const std::string what = "this cell describes another arm: " + *why;
    if (!options.force) return Error{what + "; use --force to accept it anyway"};
    std::cerr << fmt::format("warning: {}\n", what);
    return {};
  }
  const Result<std::vector<std::string>> objections = PrintMoves(options, *in_force, cell);
  if (!objections) return objections.failure();
  if (objections->empty() || options.force) return {};
  const std::string remedy =
      "check its report and the measurement that it was fitted to; --force puts it in force anyway";
  if (applying) return Error{"see the warnings above; " + remedy};
  std::cerr << fmt::format("applying it will be refused: {}\n", remedy);
  return {};
}

int Propose(const ModelOptions& options) {
  config::FaultList faults;
  const auto text = config::ReadRequiredFile(options.file, faults);
  const auto cell = text ? config::CellFromText(*text, options.file, faults) : std::nullopt;
  std::cerr << config::FaultsText(faults);
  if (!cell) return kExitFault;
  if (const auto why_not = cell::ModelUnusableReason(*cell)) {
    return Fail(
        fmt::format("not proposed: the daemon could not use {}: {}", options.file, *why_not),
        kExitFault);
  }
  cell::ModelFacts facts;
  if (!options.diagnosis.empty()) {
    const Result<std::string> diagnosis = files::ReadFileUpTo(files::kTableSize, options.diagnosis);
    const Result<cell::ModelFacts> read =
        diagnosis ? cell::ModelFactsFromDiagnosis(*diagnosis)
                  : Error{files::ReadErrorText(options.diagnosis, diagnosis.error())};
    if (!read) return Fail(fmt::format("{}: {}", options.diagnosis, read.error()), kExitFault);
    facts = *read;
  }
  config::FaultList unreadable;
  if (!options.report.empty() &&
      !config::ReadRequiredFile(options.report, unreadable, files::kTableSize)) {
    std::cerr << config::FaultsText(unreadable);
    return kExitFault;
  }
  facts.from = options.file;
  if (!std::filesystem::is_directory(options.state)) {
    return Fail(
        fmt::format("{}: no such state directory; give the daemon's with --state, or create "
                    "it first",
                    options.state),
        kExitUsage);
  }
  Result<cell::ModelStore> store = OpenReporting(options.state);
  if (!store) return Fail(store.error(), kExitUsage);
  if (const auto may = MayReplaceModelInForce(options, *store, *cell, false); !may) {
    return Fail("not proposed: " + may.error(), kExitFault);
  }
  const Result<int> number = store.value().Propose(*text, facts, options.report);
  if (!number) return Fail(number.error(), kExitUsage);
  std::cout << fmt::format("version {} proposed; {} puts it in force\n", *number,
                           cell::ModelCommand(fmt::format("apply {}", *number), options.state));
  return kExitOk;
}

int NotifyAndReport(const ModelOptions& options, int number) {
  const Result<cell::Notified> notified = cell::NotifyDaemon(options.state);
  if (!notified) {
    return Fail(fmt::format("version {} is applied, but {}; send the daemon SIGHUP, or restart it",
                            number, notified.error()),
                kExitUsage);
  }
  std::cout << fmt::format("version {} is applied{}\n", number,
                           *notified == cell::Notified::kYes
                               ? "; the running daemon was notified to load it (`plumbline status` "
                                 "shows the model in force)"
                               : "; no daemon is running, so it takes effect at the next start");
  return kExitOk;
}

int ApplyVersion(const ModelOptions& options, int number) {
  Result<cell::ModelStore> store = ExistingStore(options);
  if (!store) return Fail(store.error(), kExitFault);
  if (!Exists(*store, number)) return kExitFault;
  const Result<std::string> text = store->Text(number);
  if (!text) return Fail(text.error(), kExitFault);
  config::FaultList faults;
  const auto cell = config::CellFromText(*text, store->ModelFile(number), faults);
  if (!cell) {
    std::cerr << config::FaultsText(faults);
    return Fail("not applied", kExitFault);
  }
  config::FaultList changed;
  cell::AppendChangedModelWarning(faults, store->ModelFile(number), changed);
  std::cerr << config::FaultsText(changed);
  if (const auto why_not = cell::ModelUnusableReason(*cell)) {
    return Fail(fmt::format("version {} not applied: {}", number, *why_not), kExitFault);
  }
  if (const auto may = MayReplaceModelInForce(options, *store, *cell, true); !may) {
    return Fail(fmt::format("version {} not applied: {}", number, may.error()), kExitFault);
  }
  const Result<void> applied = store.value().Apply(number, options.force);
  if (!applied) return Fail(applied.error(), kExitUsage);
  return NotifyAndReport(options, number);
}

int Apply(const ModelOptions& options) {
  return ApplyVersion(options, options.number.value_or(0));
}

int RollBack(const ModelOptions& options) {
  if (options.number) return ApplyVersion(options, *options.number);
  Result<cell::ModelStore> store = ExistingStore(options);
  if (!store) return Fail(store.error(), kExitFault);
  const Result<cell::ModelState> state = store->State();
  if (!state) return Fail(state.error(), kExitFault);
  const std::vector<int>& history = state->history;
  const int before = history.size() < 2 ? 0 : history[history.size() - 2];
  const Result<std::string> text = before == 0 ? Error{""} : store->Text(before);
  config::FaultList
      ignored;  // rolling back must be possible even if the present version has faults
  const auto cell =
      text ? config::CellFromText(*text, store->ModelFile(before), ignored) : std::nullopt;
  const auto in_force = ModelInForce(*store);
  // Another arm is not refused here, since it was in force before.
  if (cell && in_force && !cell::DifferentArmReason(*in_force, *cell)) {
    if (const auto may = MayReplaceModelInForce(options, *store, *cell, true); !may) {
      return Fail(fmt::format("not rolled back to version {}: {}", before, may.error()),
                  kExitFault);
    }
  }
  const Result<int> number = store.value().RollBack(options.force);
  if (!number) return Fail(number.error(), history.size() < 2 ? kExitFault : kExitUsage);
  return NotifyAndReport(options, *number);
}

}  // namespace

void AddModelCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<ModelOptions>();
  CLI::App* model = app.add_subcommand("model", "Manage the versions of the cell's model");
  model->require_subcommand(1);
  model->footer(
      "All versions are stored in the folder `models` of the daemon's state_directory. A running\n"
      "daemon switches to another version between two cycles.\n\n"
      "Examples:\n  plumbline model list\n  plumbline model apply 4\n  plumbline model rollback");
  const auto add = [&](const char* name, const char* what, int (*run)(const ModelOptions&),
                       const char* footer) {
    return AddStateSubcommand(*model, name, what, options, run, footer, exit_code);
  };
  CLI::App* list =
      add("list", "List all versions", List,
          "Errors are root mean squares on held-out rows. If an edit of the cell file has set the "
          "applied\nversion aside, the reason is printed below the table.\n\n"
          "Example:\n  plumbline model list\n\n"
          "Exit codes: 0 listed, 1 the store does not exist or is damaged, 2 wrong arguments.");
  list->add_flag("--json", options->json, "Print JSON");

  CLI::App* show = add("show", "Print one version: its origin and its cell.toml", Show,
                       "Example:\n  plumbline model show 3 > cell.toml\n\n"
                       "Exit codes: 0 printed, 1 no store or no such version, 2 wrong arguments.");
  show->add_option("version", options->number, "Version number; default: the one in force");
  show->add_flag("--json", options->json, "Print its metadata as JSON");

  CLI::App* propose =
      add("propose", "Store a cell.toml as a new version, to be applied by a person", Propose,
          "Example:\n  plumbline model propose corrected.toml --diagnosis diagnosis.json\n\n"
          "Exit codes: 0 stored, 1 faults in the input or a file that cannot be read, 2 wrong "
          "arguments,\n"
          "or it cannot be stored.");
  propose->add_option("model", options->file, "CELL.toml")->required();
  propose->add_option("--diagnosis", options->diagnosis, "DIAGNOSIS.json of the same diagnosis");
  propose->add_option("--report", options->report, "Report of the same diagnosis, stored with it");
  propose->add_flag("--force", options->force, "Accept a cell that describes another arm");

  CLI::App* apply =
      add("apply", "Put a version in force", Apply,
          "Prints to standard error how the corrected command of each configured "
          "point changes,\nunder its load. Replaces a damaged state.json. If a model "
          "was set aside because the\ncell file was edited, applying the declared "
          "version confirms the edit.\n\n"
          "Example:\n  plumbline model apply 4\n\n"
          "Exit codes: 0 in force, 1 no such version, it has faults, or it was refused without\n"
          "--force, 2 it could not be applied, or the daemon could not be notified.");
  apply->add_option("version", options->number, "Version number")->required();
  apply->add_flag("--force", options->force,
                  "Put it in force although it describes another arm, or there are warnings about\n"
                  "the points");

  CLI::App* rollback =
      add("rollback", "Put the previous version in force again", RollBack,
          "Example:\n  plumbline model rollback\n\n"
          "Exit codes: 0 in force, 1 there is no previous version, or it was refused without\n"
          "--force, 2 it could not be applied, or the daemon could not be notified.");
  rollback->add_option("--to", options->number, "Roll back to this version");
  rollback->add_flag(
      "--force", options->force,
      "Put it in force although it describes another arm, or there are warnings about\n"
      "the points");
}

}  // namespace plumbline::cli
