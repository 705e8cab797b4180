#include "app/cli/model_command.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "app/cli/exit_codes.h"
#include "app/cli/failure.h"
#include "app/cli/model_moves.h"
#include "app/config/cell_reader.h"
#include "app/config/daemon_config.h"
#include "app/config/text_file.h"
#include "app/model_store/daemon_signal.h"
#include "app/model_store/model_change.h"
#include "app/model_store/model_json.h"
#include "app/model_store/usable_model.h"
#include "app/text/json_text.h"
#include "drivers/files/open_failure.h"

namespace plumbline {
namespace {

struct ModelOptions {
  std::string state = kUsualStateDirectory;
  std::string file, diagnosis, report, config;
  std::optional<int> number;
  bool json = false, force = false;
};

/// Says on the error output whom a writer waits for.
Result<ModelStore> OpenReporting(const std::string& state_directory) {
  Result<ModelStore> store = ModelStore::Open(state_directory);
  if (!store) return store;
  store.value().ReportWaits([](const std::string& what) { std::cerr << what << std::endl; });
  return store;
}

/// The store of an existing state directory: reading must not make one.
Result<ModelStore> ExistingStore(const ModelOptions& options) {
  if (!std::filesystem::exists(options.state + "/models")) {
    return Error{
        fmt::format("{}/models: no models there yet; the daemon makes it at its first "
                    "start, or give another --state",
                    options.state)};
  }
  return OpenReporting(options.state);
}

/// Tells it where there is no such version.
bool Exists(const ModelStore& store, int number) {
  std::error_code unknown;
  if (std::filesystem::exists(store.ModelFile(number), unknown)) return true;
  std::cerr << fmt::format("no version {}; `plumbline model list` tells which there are\n", number);
  return false;
}

std::string MarkOf(int number, const ModelState& state) {
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

nlohmann::json AsJson(const ModelVersion& version, const ModelState& state) {
  nlohmann::json json = JsonOrNull(JsonFrom(version.facts));
  json["version"] = version.number;
  json["applied"] = version.number == state.applied;
  json["proposed"] = version.number == state.proposed;
  json["declared"] = version.number == state.declared;
  const bool aside = state.set_aside && version.number == state.set_aside->version;
  json["set_aside"] = aside;
  if (aside) json["set_aside_because"] = state.set_aside->changes;
  return json;
}

/// Why an applied version is not in force: the paragraph, then every key that changed.
void PrintSetAside(const ModelState& state, const std::string& state_directory) {
  if (!state.set_aside) return;
  std::cout << '\n' << SetAsideText(state, state_directory) << '\n';
  for (const std::string& change : state.set_aside->changes) std::cout << "  " << change << '\n';
}

int List(const ModelOptions& options) {
  const Result<ModelStore> store = ExistingStore(options);
  if (!store) return Fail(store.error(), kExitFault);
  const Result<ModelState> known = store->State();
  const auto versions = store->Versions();
  if (!versions) return Fail(versions.error(), kExitFault);
  // Where the state cannot be read, a person chooses among the versions: they are listed all the
  // same, unmarked.
  const ModelState state = known ? *known : ModelState{};
  if (options.json) {
    nlohmann::json list = nlohmann::json::array();
    for (const ModelVersion& version : *versions) {
      nlohmann::json one = AsJson(version, state);
      for (const char* mark : {"applied", "proposed", "declared", "set_aside"}) {
        if (!known) one[mark] = nullptr;
      }
      list.push_back(std::move(one));
    }
    std::cout << list.dump(1) << '\n';
    return known ? kExitOk : Fail(known.error(), kExitFault);
  }
  std::cout << fmt::format("{:>7}  {:<20}  {:<9}  {:<9}  {:>9}  {:>9}  {}\n", "version", "date",
                           "origin", "verdict", "before mm", "after mm", "");
  for (const auto& [number, facts] : *versions) {
    std::cout << fmt::format("{:>7}  {:<20}  {:<9}  {:<9}  {:>9}  {:>9}  {}\n", number, facts.date,
                             NameOf(facts.origin), facts.verdict.empty() ? "-" : facts.verdict,
                             Millimetres(facts.rms_before_mm), Millimetres(facts.rms_after_mm),
                             MarkOf(number, state));
  }
  PrintSetAside(state, options.state);
  return known ? kExitOk : Fail(known.error(), kExitFault);
}

int Show(const ModelOptions& options) {
  const Result<ModelStore> store = ExistingStore(options);
  if (!store) return Fail(store.error(), kExitFault);
  const Result<ModelState> state = store->State();
  if (!state) return Fail(state.error(), kExitFault);
  const int number = options.number.value_or(state->applied);
  if (!Exists(*store, number)) return kExitFault;
  const Result<ModelFacts> facts = store->Facts(number);
  if (!facts) return Fail(facts.error(), kExitFault);
  const Result<std::string> text = store->Text(number);
  if (!text) return Fail(text.error(), kExitFault);
  if (options.json) {
    nlohmann::json json = AsJson({number, *facts}, *state);
    json["file"] = store->ModelFile(number);
    std::cout << json.dump(1) << '\n';
    return kExitOk;
  }
  std::cout << fmt::format("# version {}  {}\n# {}, {}, from {}\n", number, MarkOf(number, *state),
                           NameOf(facts->origin), facts->date, facts->from);
  if (facts->based_on) std::cout << fmt::format("# based on version {}\n", *facts->based_on);
  if (!facts->verdict.empty()) {
    std::cout << fmt::format("# {}: {}; held out {} -> {} mm\n", facts->verdict,
                             fmt::join(facts->effects, ", "), Millimetres(facts->rms_before_mm),
                             Millimetres(facts->rms_after_mm));
  }
  for (const std::string& implausible : facts->implausible) {
    std::cout << "# implausible on a sound machine: " << implausible << '\n';
  }
  if (facts->discrepancy_share) {
    std::cout << fmt::format("# {:.0f} % of the correction has no name\n",
                             100 * *facts->discrepancy_share);
  }
  if (facts->change_mm) {
    std::cout << fmt::format("# changes the predicted tip by up to {:.3f} mm\n", *facts->change_mm);
  }
  if (facts->points_change_mm) {
    std::cout << fmt::format("# moved the configured points by up to {:.3f} mm when it was found\n",
                             *facts->points_change_mm);
  }
  if (!facts->report.empty()) {
    std::cout << fmt::format("# report: {}\n", store->ReportFile(number));
  }
  std::cout << *text;
  return kExitOk;
}

/// The model in force; nothing where there is none yet, or it cannot be read.
std::optional<CellModel> ModelInForce(const ModelStore& store) {
  const Result<ModelState> state = store.State();
  if (!state || state->applied == 0) return std::nullopt;
  const Result<std::string> text = store.Text(state->applied);
  FaultList ignored;
  return text ? CellFromText(*text, store.ModelFile(state->applied), ignored) : std::nullopt;
}

/// Prints how far a model is from the one in force. @return false where it may not follow it: it is
/// another arm's, or the configuration that was given cannot be used
bool MayFollow(const ModelOptions& options, const ModelStore& store, const CellModel& cell) {
  const std::optional<CellModel> in_force = ModelInForce(store);
  if (!in_force) {
    std::cerr << "by how much points move is not known: no model is known to be in force\n";
    return true;
  }
  if (const auto why = WhyAnotherArm(*in_force, cell)) {
    std::cerr << fmt::format("{}this is another arm's cell: {}{}\n",
                             options.force ? "warning: " : "", *why,
                             options.force ? "" : "; --force takes it all the same");
    return options.force;
  }
  const Result<std::string> moves = MovesText(options.state, options.config, *in_force, cell);
  std::cerr << (moves ? *moves : moves.error() + "\n");
  return moves.ok();
}

int Propose(const ModelOptions& options) {
  const Result<std::string> text = ReadTextFile(options.file);
  if (!text) {
    return Fail(fmt::format("{}: {}", options.file, CannotBeRead(options.file, text.error())),
                kExitFault);
  }
  FaultList faults;
  const auto cell = CellFromText(*text, options.file, faults);
  std::cerr << FaultsText(faults);
  if (!cell) return kExitFault;
  ModelFacts facts;
  if (!options.diagnosis.empty()) {
    const Result<std::string> diagnosis = ReadTextFile(options.diagnosis);
    const Result<ModelFacts> read = diagnosis
                                        ? ModelFactsFromDiagnosis(*diagnosis)
                                        : Error{CannotBeRead(options.diagnosis, diagnosis.error())};
    if (!read) return Fail(fmt::format("{}: {}", options.diagnosis, read.error()), kExitFault);
    facts = *read;
  }
  if (!options.report.empty()) {
    const Result<std::string> report = ReadTextFile(options.report);
    if (!report) {
      return Fail(
          fmt::format("{}: {}", options.report, CannotBeRead(options.report, report.error())),
          kExitFault);
    }
  }
  facts.from = options.file;
  if (!std::filesystem::is_directory(options.state)) {
    return Fail(fmt::format("{}: no such state directory; give the daemon's by --state, or make it "
                            "first",
                            options.state),
                kExitUsage);
  }
  Result<ModelStore> store = OpenReporting(options.state);
  if (!store) return Fail(store.error(), kExitUsage);
  if (!MayFollow(options, *store, *cell)) return Fail("not proposed", kExitFault);
  const Result<int> number = store.value().Propose(*text, facts, options.report);
  if (!number) return Fail(number.error(), kExitUsage);
  std::cout << fmt::format("version {} proposed; {} puts it in force\n", *number,
                           ModelCommand(fmt::format("apply {}", *number), options.state));
  return kExitOk;
}

int NotifyAndReport(const ModelOptions& options, int number) {
  const Result<Notified> notified = NotifyDaemon(options.state);
  if (!notified) {
    return Fail(fmt::format("version {} is applied, but {}; send it SIGHUP, or restart it", number,
                            notified.error()),
                kExitUsage);
  }
  std::cout << fmt::format("version {} is applied{}\n", number,
                           *notified == Notified::kYes
                               ? "; the daemon was asked to take it up (`plumbline status` shows "
                                 "the model in force)"
                               : ": in force from the daemon's next start (none runs)");
  return kExitOk;
}

int ApplyVersion(const ModelOptions& options, int number) {
  Result<ModelStore> store = ExistingStore(options);
  if (!store) return Fail(store.error(), kExitFault);
  if (!Exists(*store, number)) return kExitFault;
  const Result<std::string> text = store->Text(number);
  if (!text) return Fail(text.error(), kExitFault);
  FaultList faults;
  const auto cell = CellFromText(*text, store->ModelFile(number), faults);
  if (!cell) {
    std::cerr << FaultsText(faults);
    return Fail("not applied", kExitFault);
  }
  FaultList changed;
  AppendChangedModelWarning(faults, store->ModelFile(number), changed);
  std::cerr << FaultsText(changed);
  if (const auto why_not = WhyNotUsable(*cell)) {
    return Fail(fmt::format("version {} not applied: {}", number, *why_not), kExitFault);
  }
  if (!MayFollow(options, *store, *cell)) {
    return Fail(fmt::format("version {} not applied", number), kExitFault);
  }
  const Result<void> applied = store.value().Apply(number);
  if (!applied) return Fail(applied.error(), kExitUsage);
  return NotifyAndReport(options, number);
}

int Apply(const ModelOptions& options) {
  return ApplyVersion(options, options.number.value_or(0));
}

int RollBack(const ModelOptions& options) {
  if (options.number) return ApplyVersion(options, *options.number);
  Result<ModelStore> store = ExistingStore(options);
  if (!store) return Fail(store.error(), kExitFault);
  const Result<ModelState> state = store->State();
  if (!state) return Fail(state.error(), kExitFault);
  const std::vector<int>& history = state->history;
  const int before = history.size() < 2 ? 0 : history[history.size() - 2];
  const Result<std::string> text = before == 0 ? Error{""} : store->Text(before);
  FaultList ignored;  // a version that was in force, and may be left for another one
  const auto cell = text ? CellFromText(*text, store->ModelFile(before), ignored) : std::nullopt;
  const auto in_force = ModelInForce(*store);
  if (cell && in_force && !WhyAnotherArm(*in_force, *cell)) {
    const Result<std::string> moves = MovesText(options.state, options.config, *in_force, *cell);
    if (!moves) return Fail(moves.error(), kExitFault);
    std::cerr << *moves;
  }
  const Result<int> number = store.value().RollBack();
  if (!number) return Fail(number.error(), history.size() < 2 ? kExitFault : kExitUsage);
  return NotifyAndReport(options, *number);
}

}  // namespace

void AddModelCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<ModelOptions>();
  CLI::App* model =
      app.add_subcommand("model", "Versions of the cell's model, and which one is in force");
  model->require_subcommand(1);
  model->footer(
      "Every version is kept in the folder `models` of the daemon's state_directory. A running\n"
      "daemon takes a change over between two cycles.");
  const auto add_config = [&](CLI::App* command) {
    command->add_option("--config", options->config,
                        "The daemon's plumbline.toml, whose points are compared; default: the one "
                        "that the\ndaemon noted in its state directory");
  };
  const auto add = [&](const char* name, const char* what, int (*run)(const ModelOptions&),
                       const char* footer) {
    CLI::App* command = model->add_subcommand(name, what);
    command->add_option("--state", options->state, "The daemon's state_directory")
        ->capture_default_str();
    command->footer(footer);
    command->callback([options, run, &exit_code] { exit_code = run(*options); });
    return command;
  };
  CLI::App* list = add(
      "list", "All versions", List,
      "Errors are root mean squares on rows that took no part in the fit. Below the table: "
      "why an\napplied version is not in force, where an edit of the cell file set it aside.\n\n"
      "Example:\n  plumbline model list\n\n"
      "Exit codes: 0 listed, 1 no store there or a damaged one, 2 wrong arguments.");
  list->add_flag("--json", options->json, "For programs");

  CLI::App* show =
      add("show", "One version: where it came from, and its cell.toml", Show,
          "Example:\n  plumbline model show 3 > cell.toml\n\n"
          "Exit codes: 0 shown, 1 no store or no such version there, 2 wrong arguments.");
  show->add_option("version", options->number, "Its number; default: the one in force");
  show->add_flag("--json", options->json, "Its facts, for programs");

  CLI::App* propose =
      add("propose", "Keeps a cell.toml as a new version, to be applied by a person", Propose,
          "Example:\n  plumbline model propose corrected.toml --diagnosis diagnosis.json\n\n"
          "Exit codes: 0 kept, 1 faults in the input or a file that cannot be read, 2 wrong "
          "arguments,\n"
          "or it cannot be kept.");
  propose->add_option("model", options->file, "CELL.toml")->required();
  propose->add_option("--diagnosis", options->diagnosis, "The DIAGNOSIS.json it came with");
  propose->add_option("--report", options->report, "Its report, kept beside it");
  propose->add_flag("--force", options->force, "Even if it is another arm's");
  add_config(propose);

  CLI::App* apply = add("apply", "Puts a version in force", Apply,
                        "Tells on the error output where the corrected command of each configured "
                        "point is now\nand will be, with its load. Writes a damaged state.json "
                        "anew. The declared version,\napplied, confirms an edited cell file where "
                        "a model was set aside for it.\n\n"
                        "Example:\n  plumbline model apply 4\n\n"
                        "Exit codes: 0 in force, 1 no such version or a faulty one, 2 not chosen, "
                        "or the daemon\ncould not be told.");
  apply->add_option("version", options->number, "Its number")->required();
  apply->add_flag("--force", options->force, "Even if it is another arm's");
  add_config(apply);

  CLI::App* rollback = add(
      "rollback", "Puts the version in force that was so before", RollBack,
      "Example:\n  plumbline model rollback\n\n"
      "Exit codes: 0 in force, 1 there is none before, 2 not chosen, or the daemon could not be "
      "told.");
  rollback->add_option("--to", options->number, "This version instead");
  rollback->add_flag("--force", options->force, "Even if that is another arm's");
  add_config(rollback);
}

}  // namespace plumbline
