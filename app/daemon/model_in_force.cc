#include "app/daemon/model_in_force.h"

#include <fmt/format.h>

#include <filesystem>
#include <functional>
#include <map>

#include "app/config/daemon_config_reader.h"
#include "app/config/text_file.h"
#include "app/model_store/cell_difference.h"
#include "app/model_store/usable_model.h"
#include "drivers/files/open_failure.h"

namespace plumbline {
namespace {

/// The daemon's main thread reads the configuration while the service manager waits for its sign of
/// life: by count of points, so that it takes no longer than that with any configuration.
constexpr std::size_t kPosturesChecked = 20;

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
Result<Noted> NoteDeclared(ModelStore& store, const ModelState& before, const DaemonConfig& config,
                           const std::string& cell, const Warn& warn) {
  const std::string& directory = config.state_directory;
  const bool another = before.applied != before.declared;
  const bool compared = another && before.declared != 0;
  const Result<std::string> former = compared ? store.Text(before.declared) : std::string();
  if (!former) {
    warn(
        fmt::format("version {}, the declared one, cannot be read ({}), so that nobody knows "
                    "whether the cell file is another since; version {} stays in force",
                    before.declared, former.error(), before.applied));
    return Noted{before, ""};
  }
  const Result<int> declared = store.Declare(cell, config.cell_file);
  if (!declared) {
    const bool edited = compared && !CellTextDifferences(*former, cell).empty();
    return NotNoted(before, edited, directory, declared.error(), warn);
  }
  Result<ModelState> now = store.State();
  if (!now) return Error{now.error()};
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

}  // namespace

std::optional<ConfigInForce> ReadConfigInForce(const std::string& path, FaultList& faults,
                                               const std::string& state_directory) {
  const Result<std::string> text = ReadTextFile(path);
  if (!text) {
    faults.Add({Fault::Severity::kFault, path, 0, "", CannotBeRead(path, text.error())});
    return std::nullopt;
  }
  // Read once: what is noted in the store, and read again below, is what was parsed.
  std::map<std::string, std::string> texts;
  const auto keep = [&texts](const std::string& file) {
    Result<std::string> content = ReadTextFile(file);
    if (content) texts[file] = *content;
    return content;
  };
  std::optional<DaemonConfig> declared =
      DaemonConfigFromText(*text, path, keep, faults, kPosturesChecked);
  if (!declared) return std::nullopt;
  const std::string asked = declared->state_directory;
  if (!state_directory.empty()) declared->state_directory = state_directory;
  const std::string directory = declared->state_directory;
  const auto warn = [&](const std::string& what) {
    faults.Add({Fault::Severity::kWarning, directory, 0, "", what});
  };
  const auto refuse = [&](const std::string& what) {
    faults.Add({Fault::Severity::kFault, directory, 0, "", what});
    return std::nullopt;
  };
  Result<ModelStore> store = ModelStore::Open(directory);
  if (!store) {
    const std::string unknown = "whether a model was applied is not known: " + store.error();
    const std::string remedy =
        fmt::format("Make {}/models a folder that the daemon's user can read and write", directory);
    const bool may_hold_one = MayHoldOne(directory);
    if (may_hold_one && !state_directory.empty()) {
      return refuse(
          fmt::format("{}. The cell file is not taken in its place. {}", unknown, remedy));
    }
    WarnNotKept(warn, store.error(), remedy);
    return ConfigInForce{
        std::move(*declared),
        asked,
        {},
        may_hold_one ? fmt::format("{}. Points are corrected by the cell file. {}, then reload "
                                   "(`systemctl reload plumbline`)",
                                   unknown, remedy)
                     : ""};
  }
  const Result<ModelState> before = store->State();
  if (!before) return refuse(before.error());
  Result<Noted> noted =
      NoteDeclared(store.value(), *before, *declared, texts[declared->cell_file], warn);
  if (!noted) return refuse(noted.error());
  const ModelState& state = noted->models;
  if (state.applied == state.declared) {
    return ConfigInForce{std::move(*declared), asked, state, noted->set_aside};
  }

  const FileSource files = [&](const std::string& file) {
    return file == declared->cell_file ? store->Text(state.applied) : ReadTextFile(file);
  };
  FaultList own;
  std::optional<DaemonConfig> applied = DaemonConfigFromText(*text, path, files, own, 0);
  if (applied) {
    if (const auto why_not = WhyNotUsable(applied->machine.cell)) {
      own.Add(
          {Fault::Severity::kFault, store->ModelFile(state.applied), 0, "effect",
           fmt::format("{}; choose another version by {} or {}", *why_not,
                       ModelCommand("rollback", directory), ModelCommand("apply N", directory))});
    }
  }
  if (!applied || own.HasFaults()) {
    AddFaultsOfModelStore(directory, "", faults);
    if (!faults.HasFaults()) faults.Append(own);  // what only the configuration beside it tells
    return std::nullopt;
  }
  applied->state_directory = directory;
  applied->machine.cell.robot.name = declared->machine.cell.robot.name;  // a label, not the model's
  return ConfigInForce{std::move(*applied), asked, state, noted->set_aside};
}

}  // namespace plumbline
