#include "app/cell/daemon/model_in_force.h"

#include <fmt/format.h>

#include <atomic>
#include <filesystem>
#include <functional>
#include <map>

#include "app/base/config/daemon_config_reader.h"
#include "app/base/config/required_file.h"
#include "app/base/service/utc_clock.h"
#include "app/cell/model_store/cell_difference.h"
#include "app/cell/model_store/configuration_note.h"
#include "app/cell/model_store/daemon_signal.h"
#include "app/cell/model_store/model_store.h"
#include "app/cell/model_store/usable_model.h"
#include "drivers/files/text_file.h"

namespace plumbline::cell {
namespace {

/// Points whose postures are checked. A start or a reload takes longer for each, so their number is
/// limited, whatever the configuration.
constexpr std::size_t kPosturesChecked = 20;

/// How long to wait for another process that writes the store. At the start, the service manager
/// waits meanwhile.
constexpr double kLockTimeout_s = 1.5;

/// State of the store after the cell file was recorded in it.
struct StoreOutcome {
  ModelState models;
  std::string set_aside;  ///< see ConfigInForce
};

using Warn = std::function<void(const std::string&)>;

/// @param why     the cause, with its file
/// @param remedy  what makes the store usable
void WarnNotStored(const Warn& warn, const std::string& why, const std::string& remedy) {
  warn(
      fmt::format("models are not stored, and points are corrected by the cell file: {}. {}, then "
                  "reload (`systemctl reload plumbline`)",
                  why, remedy));
}

/// What is in force if the cell file could not be recorded.
/// @param edited  whether it describes another cell than the one declared before
StoreOutcome NotRecorded(const ModelState& before, bool edited, const std::string& directory,
                         const std::string& why, const Warn& warn) {
  const bool other_applied = before.applied != before.declared;
  if (!other_applied && before.set_aside && before.set_aside->version == 0) {
    warn("the model store cannot be written: " + why);
    return StoreOutcome{{}, SupersededText(before, directory)};
  }
  if (!other_applied && !before.set_aside) {
    WarnNotStored(warn, why,
                  fmt::format("Make {}/models writable for the daemon's user", directory));
    return StoreOutcome{};
  }
  if (other_applied && !edited) {
    warn(
        fmt::format("the cell file cannot be recorded in the model store: {}. Version {} stays in "
                    "force. Once the store can be written, reload (`systemctl reload plumbline`)",
                    why, before.applied));
    return StoreOutcome{before, ""};
  }
  const int version = other_applied ? before.applied : before.set_aside->version;
  warn("the model store cannot be written: " + why);
  return StoreOutcome{
      {},
      fmt::format("model version {} is set aside: the cell file has changed since it was "
                  "applied, and that could not be recorded ({}). Points are corrected by "
                  "the cell file. Once {} can be written, reload; {} then applies version "
                  "{} anyway",
                  version, why, directory,
                  ModelCommand(fmt::format("apply {}", version), directory), version)};
}

/// Records the cell file in the store.
/// @param before    the store's state
/// @param cell      text of the cell file, as it was parsed
/// @param expected  whether versions may have been lost if the store holds none
/// @return          an error if the store's state cannot be read afterwards
Result<StoreOutcome> RecordDeclared(ModelStore& store, const ModelState& before,
                                    const config::DaemonConfig& config, const std::string& cell,
                                    ModelStore::Expected expected, const Warn& warn) {
  const std::string& directory = config.state_directory;
  const bool other_applied = before.applied != before.declared;
  const bool compared = other_applied && before.declared != 0;
  const Result<std::string> previous = compared ? store.Text(before.declared) : std::string();
  if (!previous) {
    warn(
        fmt::format("the declared version {} cannot be read ({}), so it is not known whether the "
                    "cell file has changed since; version {} stays in force",
                    before.declared, previous.error(), before.applied));
    return StoreOutcome{before, ""};
  }
  const Result<int> declared = store.Declare(cell, config.cell_file, expected);
  if (!declared) {
    const bool edited = compared && !CellTextDifferences(*previous, cell).empty();
    ModelState found = before;
    if (expected == ModelStore::Expected::kVersions && before == ModelState{}) {
      found.set_aside = SupersededVersion{};
    }
    return NotRecorded(found, edited, directory, declared.error(), warn);
  }
  Result<ModelState> now = store.State();
  if (!now) return now.failure();
  const std::string set_aside = now->set_aside ? SupersededText(*now, directory) : "";
  return StoreOutcome{std::move(now).value(), set_aside};
}

/// Whether a store that could not be opened may hold an applied model.
bool MayHoldAppliedModel(const std::string& directory) {
  std::error_code hidden;
  return std::filesystem::is_directory(directory + "/models", hidden) ||
         (hidden && hidden != std::errc::no_such_file_or_directory &&
          hidden != std::errc::not_a_directory);
}

/// What is in force in a directory that another daemon owns, and where this one changes nothing.
/// @param cell  text of the cell file, as it was parsed
StoreOutcome FromStoreOfOtherDaemon(const ModelStore& store, const ModelState& before,
                                    const std::string& cell, const Warn& warn) {
  if (before.applied == before.declared) return StoreOutcome{};
  const Result<std::string> declared = store.Text(before.declared);
  if (declared && CellTextDifferences(*declared, cell).empty()) return StoreOutcome{before, ""};
  warn(fmt::format(
      "another plumblined maintains the models in this directory, and its version {} belongs "
      "to another cell: points are corrected by this daemon's cell file. Give this "
      "daemon its own state_directory",
      before.applied));
  return StoreOutcome{};
}

/// The configuration as its files declare it, and the text of its cell file as it was parsed.
struct Declared {
  std::string text;  ///< of the configuration
  config::DaemonConfig config;
  std::string configured_state_directory;
  std::string cell;
};

std::optional<Declared> ReadDeclared(const std::string& path, config::FaultList& faults,
                                     const std::optional<RunningDaemon>& running) {
  const auto text = config::ReadRequiredFile(path, faults);
  if (!text) return std::nullopt;
  // Each file is read once, so that the text recorded in the store is the text that was parsed.
  std::map<std::string, std::string> texts;
  const auto read = [&texts](const std::string& file) {
    Result<std::string> content = files::ReadTextFile(file);
    if (content) texts[file] = *content;
    return content;
  };
  std::optional<config::DaemonConfig> config =
      config::DaemonConfigFromText(*text, path, read, faults, kPosturesChecked);
  if (!config) return std::nullopt;
  Declared declared{*text, std::move(*config), "", ""};
  declared.configured_state_directory = declared.config.state_directory;
  declared.cell = texts[declared.config.cell_file];
  if (running) declared.config.state_directory = running->state_directory;
  return declared;
}

/// The configuration with the applied version of the store in place of its cell file.
std::optional<config::DaemonConfig> ReadApplied(const std::string& path, const Declared& declared,
                                                const ModelStore& store, int version,
                                                config::FaultList& faults) {
  const std::string& directory = declared.config.state_directory;
  const config::FileSource files = [&](const std::string& file) {
    return file == declared.config.cell_file ? store.Text(version) : files::ReadTextFile(file);
  };
  config::FaultList model_faults;
  std::optional<config::DaemonConfig> applied =
      config::DaemonConfigFromText(declared.text, path, files, model_faults, 0);
  if (applied) {
    if (const auto why_not = ModelUnusableReason(applied->machine.cell)) {
      model_faults.Add(
          {config::Fault::Severity::kFault, store.ModelFile(version), 0, "effect",
           fmt::format("{}; choose another version with {} or {}", *why_not,
                       ModelCommand("rollback", directory), ModelCommand("apply N", directory))});
    }
  }
  if (!applied || model_faults.HasFaults()) {
    CheckModelStore(directory, "", faults);
    if (!faults.HasFaults()) faults.Append(model_faults);  // faults of the configuration alone
    return std::nullopt;
  }
  AppendChangedModelWarning(model_faults, store.ModelFile(version), faults);
  applied->state_directory = directory;
  // Name and identity are labels of the cell file, not parts of the model.
  const model::Robot& robot = declared.config.machine.cell.robot;
  applied->machine.cell.robot.name = robot.name;
  applied->machine.cell.robot.identity = robot.identity;
  return applied;
}

/// Why the store cannot be the one that the running daemon has used so far, with a remedy.
std::optional<std::string> StoreMismatch(const ModelState& before, const RunningDaemon& running) {
  const bool empty = before.declared == 0 && before.applied == 0;
  if (!empty || running.models.applied == running.models.declared) return std::nullopt;
  return fmt::format(
      "{}/models is empty, although version {} of it is in force. Mount its file system again, or "
      "restore the folder from a backup, then reload; to continue without its models, restart the "
      "daemon (`systemctl restart plumbline`)",
      running.state_directory, running.models.applied);
}

}  // namespace

std::uint64_t NextGeneration() {
  static std::atomic<std::uint64_t> last{
      static_cast<std::uint64_t>(1e3 * service::SystemUtcSeconds())};
  return ++last;
}

std::optional<ConfigInForce> ReadConfigInForce(const std::string& path, config::FaultList& faults,
                                               const std::optional<RunningDaemon>& running) {
  std::optional<Declared> declared = ReadDeclared(path, faults, running);
  if (!declared) return std::nullopt;
  config::DaemonConfig& config = declared->config;
  const std::string directory = config.state_directory;
  const auto warn = [&](const std::string& what) {
    faults.Add({config::Fault::Severity::kWarning, directory, 0, "", what});
  };
  const auto refuse = [&](const std::string& what) {
    faults.Add({config::Fault::Severity::kFault, directory, 0, "", what});
    return std::nullopt;
  };
  if (running && !running->owns_directory && config.monitoring.enabled) {
    return refuse(
        "another plumblined uses it, so [monitoring] cannot be enabled here. Give this daemon "
        "its own state_directory and restart it");
  }
  Result<ModelStore> store = ModelStore::Open(directory);
  if (!store) {
    const std::string unknown = "whether a model was applied is not known: " + store.error();
    const std::string remedy =
        fmt::format("Make {}/models a folder that the daemon's user can read and write", directory);
    const bool may_hold_model = MayHoldAppliedModel(directory);
    if (may_hold_model && running) {
      return refuse(fmt::format("{}. The cell file is not used in its place. {}", unknown, remedy));
    }
    WarnNotStored(warn, store.error(), remedy);
    return ConfigInForce{
        std::move(config),
        declared->configured_state_directory,
        {},
        may_hold_model ? fmt::format("{}. Points are corrected by the cell file. {}, then reload "
                                     "(`systemctl reload plumbline`)",
                                     unknown, remedy)
                       : ""};
  }
  store.value().SetLockTimeout(kLockTimeout_s);
  const Result<ModelState> before = store->State();
  if (!before) return refuse(before.error());
  if (running) {
    if (const auto why_not = StoreMismatch(*before, *running)) return refuse(*why_not);
  }
  const bool owned_by_other =
      running ? !running->owns_directory : FindOtherDaemon(directory).has_value();
  const bool used_before = !running && HasBeenUsed(directory);
  const auto expected =
      used_before ? ModelStore::Expected::kVersions : ModelStore::Expected::kNothing;
  Result<StoreOutcome> outcome =
      owned_by_other
          ? Result<StoreOutcome>(FromStoreOfOtherDaemon(*store, *before, declared->cell, warn))
          : RecordDeclared(store.value(), *before, config, declared->cell, expected, warn);
  if (!outcome) return refuse(outcome.error());
  const ModelState& state = outcome->models;
  const std::string configured = declared->configured_state_directory;
  if (state.applied == state.declared) {
    return ConfigInForce{std::move(config), configured, state, outcome->set_aside};
  }
  std::optional<config::DaemonConfig> applied =
      ReadApplied(path, *declared, *store, state.applied, faults);
  if (!applied) return std::nullopt;
  return ConfigInForce{std::move(*applied), configured, state, outcome->set_aside};
}

}  // namespace plumbline::cell
