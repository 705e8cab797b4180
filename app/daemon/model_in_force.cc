#include "app/daemon/model_in_force.h"

#include <fmt/format.h>

#include <functional>

#include "app/config/daemon_config_reader.h"
#include "app/config/text_file.h"
#include "app/model_store/usable_model.h"
#include "drivers/files/open_failure.h"

namespace plumbline {
namespace {

/// The store's state once the cell file is noted in it. Whatever takes an applied model out of
/// force is told by `warn`.
Result<ModelState> NoteDeclared(ModelStore& store, const std::string& cell_file,
                                const std::string& state_directory,
                                const std::function<void(const std::string&)>& warn) {
  const Result<std::string> text = ReadTextFile(cell_file);
  if (!text) return Error{cell_file + ": " + CannotBeRead(cell_file, text.error())};
  Result<ModelState> before = store.State();
  if (!before) return Error{before.error()};
  const bool another = before->applied != before->declared;
  const Result<std::string> former = another ? store.Text(before->declared) : std::string();
  if (!former) {
    warn(
        fmt::format("version {}, the declared one, cannot be read ({}), so that nobody knows "
                    "whether the cell file is another since; version {} stays in force",
                    before->declared, former.error(), before->applied));
    return before;
  }
  if (before->declared == 0) {
    const auto versions = store.Versions();
    if (versions && !versions->empty()) {
      warn(
          fmt::format("state.json is gone: which of the {} versions was in force is not known; the "
                      "cell file is, until {}",
                      versions->size(), ModelCommand("apply N", state_directory)));
    }
  }
  const Result<int> declared = store.Declare(*text, cell_file);
  if (!declared) return Error{declared.error()};
  if (another && *declared != before->declared) {
    warn(fmt::format(
        "version {} is no longer in force: the cell file changed since; {} takes it "
        "all the same",
        before->applied, ModelCommand(fmt::format("apply {}", before->applied), state_directory)));
  }
  return store.State();
}

}  // namespace

std::optional<ConfigInForce> ReadConfigInForce(const std::string& path, FaultList& faults,
                                               const std::string& state_directory) {
  std::optional<DaemonConfig> declared = ReadDaemonConfig(path, faults);
  if (!declared) return std::nullopt;
  const std::string asked = declared->state_directory;
  if (!state_directory.empty()) declared->state_directory = state_directory;
  const auto warn = [&](const std::string& what) {
    faults.Add({Fault::Severity::kWarning, declared->state_directory, 0, "", what});
  };
  const auto without_store = [&](const std::string& why) {
    warn("models are not kept, the cell file is in force: " + why);
    return ConfigInForce{std::move(*declared), asked, {}};
  };
  Result<ModelStore> store = ModelStore::Open(declared->state_directory);
  if (!store) return without_store(store.error());
  const Result<ModelState> state =
      NoteDeclared(store.value(), declared->cell_file, declared->state_directory, warn);
  if (!state) return without_store(state.error());
  if (state->applied == state->declared) {
    return ConfigInForce{std::move(*declared), asked, *state};
  }

  const FileSource files = [&](const std::string& file) {
    return file == declared->cell_file ? store->Text(state->applied) : ReadTextFile(file);
  };
  const Result<std::string> text = ReadTextFile(path);
  FaultList own;
  std::optional<DaemonConfig> applied;
  if (text) applied = DaemonConfigFromText(*text, path, files, own);
  if (!applied) {
    AddFaultsOfAppliedModel(declared->state_directory, faults);
    if (!faults.HasFaults()) faults.Append(own);  // what only the configuration beside it tells
    return std::nullopt;
  }
  applied->state_directory = declared->state_directory;
  return ConfigInForce{std::move(*applied), asked, *state};
}

}  // namespace plumbline
