#include "app/daemon/model_in_force.h"

#include <fmt/format.h>

#include <filesystem>
#include <functional>
#include <map>

#include "app/config/daemon_config_reader.h"
#include "app/config/text_file.h"
#include "app/model_store/cell_difference.h"
#include "app/model_store/configuration_note.h"
#include "app/model_store/daemon_signal.h"
#include "app/model_store/usable_model.h"
#include "drivers/files/open_failure.h"

namespace plumbline {
namespace {

/// The daemon's main thread reads the configuration while the service manager waits for its sign of
/// life: by count of points, so that it takes no longer than that with any configuration.
constexpr std::size_t kPosturesChecked = 20;

/// For another process to write the store. The service manager gets no sign of life meanwhile, and
/// its patience (WatchdogSec) is 4 s.
constexpr double kLongestLock_s = 1.5;

/// What the store says once the cell file is noted in it.
struct Noted {
  ModelState models;
  std::string set_aside;  ///< as of ConfigInForce
};

using Warn = std::function<void(const std::string&)>;

/// @param why     the cause, with its place
/// @param remedy  what makes the store usable
void WarnNotKept(const Warn& warn, const std::string& why, const std::string& remedy) {
  warn(
      fmt::format("models are not kept, and points are corrected by the cell file: {}. {}, then "
                  "reload (`systemctl reload plumbline`)",
                  why, remedy));
}

/// What is in force where the cell file could not be noted.
/// @param edited  whether it is another cell than the one declared before
Noted NotNoted(const ModelState& before, bool edited, const std::string& directory,
               const std::string& why, const Warn& warn) {
  const bool another = before.applied != before.declared;
  if (!another && before.set_aside && before.set_aside->version == 0) {
    warn("the model store cannot be written: " + why);
    return Noted{{}, SetAsideText(before, directory)};
  }
  if (!another && !before.set_aside) {
    WarnNotKept(warn, why, fmt::format("Make {}/models writable for the daemon's user", directory));
    return Noted{};
  }
  if (another && !edited) {
    warn(
        fmt::format("the cell file cannot be noted in the model store: {}. Version {} stays in "
                    "force. Once the store can be written, reload (`systemctl reload plumbline`)",
                    why, before.applied));
    return Noted{before, ""};
  }
  const int version = another ? before.applied : before.set_aside->version;
  warn("the model store cannot be written: " + why);
  return Noted{{},
               fmt::format("model version {} is set aside: the cell file changed since, and that "
                           "could not be noted ({}). Points are corrected by the cell file. Once "
                           "{} can be written: SIGHUP, then {} takes version {} all the same",
                           version, why, directory,
                           ModelCommand(fmt::format("apply {}", version), directory), version)};
}

/// @param before  the store's state
/// @param cell    text of the cell file, as it was parsed
/// @return        why the store's state is not known once the cell file is noted in it
/// @param expected  whether versions of the store may have been lost where it holds none
Result<Noted> NoteDeclared(ModelStore& store, const ModelState& before, const DaemonConfig& config,
                           const std::string& cell, ModelStore::Expected expected,
                           const Warn& warn) {
  const std::string& directory = config.state_directory;
  const bool another = before.applied != before.declared;
  const bool compared = another && before.declared != 0;
  const Result<std::string> previous = compared ? store.Text(before.declared) : std::string();
  if (!previous) {
    warn(
        fmt::format("version {}, the declared one, cannot be read ({}), so that nobody knows "
                    "whether the cell file is another since; version {} stays in force",
                    before.declared, previous.error(), before.applied));
    return Noted{before, ""};
  }
  const Result<int> declared = store.Declare(cell, config.cell_file, expected);
  if (!declared) {
    const bool edited = compared && !CellTextDifferences(*previous, cell).empty();
    ModelState found = before;
    if (expected == ModelStore::Expected::kVersions && before == ModelState{}) {
      found.set_aside = SetAside{};
    }
    return NotNoted(found, edited, directory, declared.error(), warn);
  }
  Result<ModelState> now = store.State();
  if (!now) return now.failure();
  const std::string set_aside = now->set_aside ? SetAsideText(*now, directory) : "";
  return Noted{std::move(now).value(), set_aside};
}

/// Whether an applied model may be in a store that could not be opened.
bool MayHoldOne(const std::string& directory) {
  std::error_code hidden;
  return std::filesystem::is_directory(directory + "/models", hidden) ||
         (hidden && hidden != std::errc::no_such_file_or_directory &&
          hidden != std::errc::not_a_directory);
}

/// What is in force in the directory of another daemon, where this one changes nothing.
/// @param cell  text of the cell file, as it was parsed
Noted AsAnotherDaemonKeepsIt(const ModelStore& store, const ModelState& before,
                             const std::string& cell, const Warn& warn) {
  if (before.applied == before.declared) return Noted{};
  const Result<std::string> declared = store.Text(before.declared);
  if (declared && CellTextDifferences(*declared, cell).empty()) return Noted{before, ""};
  warn(fmt::format(
      "another plumblined keeps the models of this directory, and its version {} belongs "
      "to another cell: points are corrected by this daemon's cell file. Give this "
      "daemon a state_directory of its own",
      before.applied));
  return Noted{};
}

/// The configuration as its files declare it, and the text of its cell file as it was parsed.
struct Declared {
  std::string text;  ///< of the configuration
  DaemonConfig config;
  std::string asked_state_directory;
  std::string cell;
};

std::optional<Declared> ReadDeclared(const std::string& path, FaultList& faults,
                                     const std::optional<DaemonAtWork>& at_work) {
  const Result<std::string> text = ReadTextFile(path);
  if (!text) {
    faults.Add({Fault::Severity::kFault, path, 0, "", CannotBeRead(path, text.error())});
    return std::nullopt;
  }
  // Read once: what is noted in the store, and read again with the applied version, is what was
  // parsed.
  std::map<std::string, std::string> texts;
  const auto keep = [&texts](const std::string& file) {
    Result<std::string> content = ReadTextFile(file);
    if (content) texts[file] = *content;
    return content;
  };
  std::optional<DaemonConfig> config =
      DaemonConfigFromText(*text, path, keep, faults, kPosturesChecked);
  if (!config) return std::nullopt;
  Declared declared{*text, std::move(*config), "", ""};
  declared.asked_state_directory = declared.config.state_directory;
  declared.cell = texts[declared.config.cell_file];
  if (at_work) declared.config.state_directory = at_work->state_directory;
  return declared;
}

/// The configuration with the version of the store that was applied in place of its cell file.
std::optional<DaemonConfig> ReadApplied(const std::string& path, const Declared& declared,
                                        const ModelStore& store, int version, FaultList& faults) {
  const std::string& directory = declared.config.state_directory;
  const FileSource files = [&](const std::string& file) {
    return file == declared.config.cell_file ? store.Text(version) : ReadTextFile(file);
  };
  FaultList own;
  std::optional<DaemonConfig> applied = DaemonConfigFromText(declared.text, path, files, own, 0);
  if (applied) {
    if (const auto why_not = WhyNotUsable(applied->machine.cell)) {
      own.Add(
          {Fault::Severity::kFault, store.ModelFile(version), 0, "effect",
           fmt::format("{}; choose another version by {} or {}", *why_not,
                       ModelCommand("rollback", directory), ModelCommand("apply N", directory))});
    }
  }
  if (!applied || own.HasFaults()) {
    AddFaultsOfModelStore(directory, "", faults);
    if (!faults.HasFaults()) faults.Append(own);  // faults that only the configuration has
    return std::nullopt;
  }
  AppendChangedModelWarning(own, store.ModelFile(version), faults);
  applied->state_directory = directory;
  // A label, not the model's.
  applied->machine.cell.robot.name = declared.config.machine.cell.robot.name;
  return applied;
}

/// Why the store of a daemon at work cannot be the one that it has used, with what to do.
std::optional<std::string> WhyNotTheSameStore(const ModelState& before,
                                              const DaemonAtWork& at_work) {
  const bool empty = before.declared == 0 && before.applied == 0;
  if (!empty || at_work.models.applied == at_work.models.declared) return std::nullopt;
  return fmt::format(
      "{}/models is empty, although version {} of it is in force. Mount its file system again, or "
      "restore the folder from a backup, then reload; to go on without its models, restart the "
      "daemon (`systemctl restart plumbline`)",
      at_work.state_directory, at_work.models.applied);
}

}  // namespace

std::optional<ConfigInForce> ReadConfigInForce(const std::string& path, FaultList& faults,
                                               const std::optional<DaemonAtWork>& at_work) {
  std::optional<Declared> declared = ReadDeclared(path, faults, at_work);
  if (!declared) return std::nullopt;
  DaemonConfig& config = declared->config;
  const std::string directory = config.state_directory;
  const auto warn = [&](const std::string& what) {
    faults.Add({Fault::Severity::kWarning, directory, 0, "", what});
  };
  const auto refuse = [&](const std::string& what) {
    faults.Add({Fault::Severity::kFault, directory, 0, "", what});
    return std::nullopt;
  };
  if (at_work && !at_work->owns_directory && config.loop.enabled) {
    return refuse(
        "another plumblined uses it, so that [loop] cannot be turned on here. Give this daemon a "
        "state_directory of its own and restart it");
  }
  Result<ModelStore> store = ModelStore::Open(directory);
  if (!store) {
    const std::string unknown = "whether a model was applied is not known: " + store.error();
    const std::string remedy =
        fmt::format("Make {}/models a folder that the daemon's user can read and write", directory);
    const bool may_hold_one = MayHoldOne(directory);
    if (may_hold_one && at_work) {
      return refuse(
          fmt::format("{}. The cell file is not taken in its place. {}", unknown, remedy));
    }
    WarnNotKept(warn, store.error(), remedy);
    return ConfigInForce{
        std::move(config),
        declared->asked_state_directory,
        {},
        may_hold_one ? fmt::format("{}. Points are corrected by the cell file. {}, then reload "
                                   "(`systemctl reload plumbline`)",
                                   unknown, remedy)
                     : ""};
  }
  store.value().WaitAtMost(kLongestLock_s);
  const Result<ModelState> before = store->State();
  if (!before) return refuse(before.error());
  if (at_work) {
    if (const auto why_not = WhyNotTheSameStore(*before, *at_work)) return refuse(*why_not);
  }
  const bool of_another = at_work ? !at_work->owns_directory : OtherDaemonOf(directory).has_value();
  const bool used = !at_work && WasUsedBefore(directory);
  const auto expected = used ? ModelStore::Expected::kVersions : ModelStore::Expected::kNothing;
  Result<Noted> noted =
      of_another ? Result<Noted>(AsAnotherDaemonKeepsIt(*store, *before, declared->cell, warn))
                 : NoteDeclared(store.value(), *before, config, declared->cell, expected, warn);
  if (!noted) return refuse(noted.error());
  const ModelState& state = noted->models;
  const std::string asked = declared->asked_state_directory;
  if (state.applied == state.declared) {
    return ConfigInForce{std::move(config), asked, state, noted->set_aside};
  }
  std::optional<DaemonConfig> applied = ReadApplied(path, *declared, *store, state.applied, faults);
  if (!applied) return std::nullopt;
  return ConfigInForce{std::move(*applied), asked, state, noted->set_aside};
}

}  // namespace plumbline
