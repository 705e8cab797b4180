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
#include "app/config/cell_reader.h"
#include "app/config/daemon_config.h"
#include "app/config/text_file.h"
#include "app/model_store/daemon_signal.h"
#include "app/model_store/model_change.h"
#include "app/model_store/model_json.h"
#include "app/model_store/usable_model.h"
#include "drivers/files/open_failure.h"

namespace plumbline {
namespace {

struct ModelOptions {
  std::string state = kUsualStateDirectory;
  std::string file, diagnosis, report;
  std::optional<int> number;
  bool json = false, force = false;
};

/// The store of an existing state directory: reading must not make one.
Result<ModelStore> ExistingStore(const ModelOptions& options) {
  if (!std::filesystem::exists(options.state + "/models")) {
    return Error{
        fmt::format("{}/models: no models there yet; the daemon makes it at its first "
                    "start, or give another --state",
                    options.state)};
  }
  return ModelStore::Open(options.state);
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
  return fmt::format("{}", fmt::join(marks, ", "));
}

std::string Millimetres(const std::optional<double>& value) {
  return value ? fmt::format("{:.3f}", *value) : "-";
}

nlohmann::json AsJson(const ModelVersion& version, const ModelState& state) {
  nlohmann::json json = nlohmann::json::parse(JsonFrom(version.facts));
  json["version"] = version.number;
  json["applied"] = version.number == state.applied;
  json["proposed"] = version.number == state.proposed;
  json["declared"] = version.number == state.declared;
  return json;
}

int List(const ModelOptions& options) {
  const Result<ModelStore> store = ExistingStore(options);
  if (!store) return Fail(store.error(), kExitFault);
  const Result<ModelState> state = store->State();
  if (!state) return Fail(state.error(), kExitFault);
  const auto versions = store->Versions();
  if (!versions) return Fail(versions.error(), kExitFault);
  if (options.json) {
    nlohmann::json list = nlohmann::json::array();
    for (const ModelVersion& version : *versions) list.push_back(AsJson(version, *state));
    std::cout << list.dump(1) << '\n';
    return kExitOk;
  }
  std::cout << fmt::format("{:>7}  {:<20}  {:<9}  {:<9}  {:>9}  {:>9}  {}\n", "version", "date",
                           "origin", "verdict", "before mm", "after mm", "");
  for (const auto& [number, facts] : *versions) {
    std::cout << fmt::format("{:>7}  {:<20}  {:<9}  {:<9}  {:>9}  {:>9}  {}\n", number, facts.date,
                             NameOf(facts.origin), facts.verdict.empty() ? "-" : facts.verdict,
                             Millimetres(facts.rms_before_mm), Millimetres(facts.rms_after_mm),
                             MarkOf(number, *state));
  }
  return kExitOk;
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
  if (facts->remainder_share) {
    std::cout << fmt::format("# {:.0f} % of the correction has no name\n",
                             100 * *facts->remainder_share);
  }
  if (facts->change_mm) {
    std::cout << fmt::format("# changes the predicted tip by up to {:.3f} mm\n", *facts->change_mm);
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

/// Tells how far a model is from the one in force. @return false where it is another arm's
bool MayFollow(const ModelOptions& options, const ModelStore& store, const CellModel& cell) {
  const std::optional<CellModel> in_force = ModelInForce(store);
  if (!in_force) return true;
  if (const auto why = WhyAnotherArm(*in_force, cell)) {
    std::cerr << fmt::format("{}this is another arm's cell: {}{}\n",
                             options.force ? "warning: " : "", *why,
                             options.force ? "" : "; --force takes it all the same");
    return options.force;
  }
  if (const auto change_m = LargestChange(*in_force, cell, PosesWithinLimits(*in_force))) {
    std::cerr << fmt::format(
        "within the joint limits it moves the tip by up to {:.3f} mm from the model in force, "
        "nothing carried\n",
        1e3 * *change_m);
  }
  return true;
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
  Result<ModelStore> store = ModelStore::Open(options.state);
  if (!store) return Fail(store.error(), kExitUsage);
  if (!MayFollow(options, *store, *cell)) return Fail("not proposed", kExitFault);
  const Result<int> number = store.value().Propose(*text, facts, options.report);
  if (!number) return Fail(number.error(), kExitUsage);
  std::cout << fmt::format("version {} proposed; {} puts it in force\n", *number,
                           ModelCommand(fmt::format("apply {}", *number), options.state));
  return kExitOk;
}

int TellDaemon(const ModelOptions& options, int number) {
  const Result<Notified> told = NotifyDaemon(options.state);
  if (!told) {
    return Fail(fmt::format("version {} is chosen, but {}; send it SIGHUP, or restart it", number,
                            told.error()),
                kExitUsage);
  }
  std::cout << fmt::format("version {} is in force{}\n", number,
                           *told == Notified::kYes ? "; the daemon was told"
                                                   : " from the daemon's next start (none runs)");
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
  if (const auto why_not = WhyNotUsable(*cell)) {
    return Fail(fmt::format("version {} not applied: {}", number, *why_not), kExitFault);
  }
  if (!MayFollow(options, *store, *cell)) {
    return Fail(fmt::format("version {} not applied", number), kExitFault);
  }
  const Result<bool> applied = store.value().Apply(number);
  if (!applied) return Fail(applied.error(), kExitUsage);
  return TellDaemon(options, number);
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
  const Result<int> number = store.value().RollBack();
  if (!number) return Fail(number.error(), state->history.size() < 2 ? kExitFault : kExitUsage);
  return TellDaemon(options, *number);
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
  const auto add = [&](const char* name, const char* what, int (*run)(const ModelOptions&),
                       const char* footer) {
    CLI::App* command = model->add_subcommand(name, what);
    command->add_option("--state", options->state, "The daemon's state_directory")
        ->capture_default_str();
    command->footer(footer);
    command->callback([options, run, &exit_code] { exit_code = run(*options); });
    return command;
  };
  CLI::App* list =
      add("list", "All versions", List,
          "Errors are root mean squares on rows that took no part in the fit.\n\n"
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

  CLI::App* apply = add("apply", "Puts a version in force", Apply,
                        "Example:\n  plumbline model apply 4\n\n"
                        "Exit codes: 0 in force, 1 no such version or a faulty one, 2 not chosen, "
                        "or the daemon\ncould not be told.");
  apply->add_option("version", options->number, "Its number")->required();
  apply->add_flag("--force", options->force, "Even if it is another arm's");

  CLI::App* rollback = add(
      "rollback", "Puts the version in force that was so before", RollBack,
      "Example:\n  plumbline model rollback\n\n"
      "Exit codes: 0 in force, 1 there is none before, 2 not chosen, or the daemon could not be "
      "told.");
  rollback->add_option("--to", options->number, "This version instead");
  rollback->add_flag("--force", options->force, "Even if that is another arm's");
}

}  // namespace plumbline
