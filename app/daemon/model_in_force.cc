#include "app/daemon/model_in_force.h"

#include <fmt/format.h>

#include <filesystem>
#include <functional>

#include "app/config/daemon_config_reader.h"
#include "app/config/text_file.h"
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

/// @param before  the store's state
/// @return        why the cell file could not be noted
Result<Noted> NoteDeclared(ModelStore& store, const ModelState& before, const DaemonConfig& config,
                           const std::function<void(const std::string&)>& warn) {
  const std::string& directory = config.state_directory;
  const Result<std::string> text = ReadTextFile(config.cell_file);
  if (!text) {
    return Error{config.cell_file + ": " + CannotBeRead(config.cell_file, text.error())};
  }
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
  const Result<int> declared = store.Declare(*text, config.cell_file);
  if (!declared) {
    if (!another && !before.set_aside) return Error{declared.error()};
    const int version = another ? before.applied : before.set_aside->version;
    warn("the model store cannot be written: " + declared.error());
    return Noted{{},
                 fmt::format("model version {} is set aside: the cell file changed since, and that "
                             "could not be noted ({}). Points are corrected by the cell file. Once "
                             "{} can be written: SIGHUP, then {} takes version {} all the same",
                             version, declared.error(), directory,
                             ModelCommand(fmt::format("apply {}", version), directory), version)};
  }
  Result<ModelState> now = store.State();
  if (!now) return Error{now.error()};
  const std::string set_aside = now->set_aside ? SetAsideText(*now, directory) : "";
  return Noted{std::move(now).value(), set_aside};
}

}  // namespace

std::optional<ConfigInForce> ReadConfigInForce(const std::string& path, FaultList& faults,
                                               const std::string& state_directory) {
  std::optional<DaemonConfig> declared = ReadDaemonConfig(path, faults, kPosturesChecked);
  if (!declared) return std::nullopt;
  const std::string asked = declared->state_directory;
  if (!state_directory.empty()) declared->state_directory = state_directory;
  const std::string directory = declared->state_directory;
  const auto warn = [&](const std::string& what) {
    faults.Add({Fault::Severity::kWarning, directory, 0, "", what});
  };
  const auto without_store = [&](const std::string& why, const std::string& set_aside) {
    warn("models are not kept, the cell file is in force: " + why);
    return ConfigInForce{std::move(*declared), asked, {}, set_aside};
  };
  Result<ModelStore> store = ModelStore::Open(directory);
  if (!store) {
    std::error_code hidden;
    const bool may_hold_one = std::filesystem::is_directory(directory + "/models", hidden) ||
                              hidden == std::errc::permission_denied;
    return without_store(
        store.error(),
        may_hold_one ? fmt::format("whether a model was applied is not known: {}. Points are "
                                   "corrected by the cell file. Make the folder readable, then "
                                   "restart",
                                   store.error())
                     : "");
  }
  const Result<ModelState> before = store->State();
  if (!before) {
    faults.Add({Fault::Severity::kFault, directory, 0, "", before.error()});
    return std::nullopt;
  }
  Result<Noted> noted = NoteDeclared(store.value(), *before, *declared, warn);
  if (!noted) return without_store(noted.error(), "");
  const ModelState& state = noted->models;
  if (state.applied == state.declared) {
    return ConfigInForce{std::move(*declared), asked, state, noted->set_aside};
  }

  const FileSource files = [&](const std::string& file) {
    return file == declared->cell_file ? store->Text(state.applied) : ReadTextFile(file);
  };
  const Result<std::string> text = ReadTextFile(path);
  FaultList own;
  std::optional<DaemonConfig> applied;
  if (text) applied = DaemonConfigFromText(*text, path, files, own, 0);
  if (!applied) {
    AddFaultsOfModelStore(directory, "", faults);
    if (!faults.HasFaults()) faults.Append(own);  // what only the configuration beside it tells
    return std::nullopt;
  }
  applied->state_directory = directory;
  applied->machine.cell.robot.name = declared->machine.cell.robot.name;  // a label, not the model's
  return ConfigInForce{std::move(*applied), asked, state, noted->set_aside};
}

}  // namespace plumbline
