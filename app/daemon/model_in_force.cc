#include "app/daemon/model_in_force.h"

#include <fmt/format.h>

#include "app/config/daemon_config_reader.h"
#include "app/config/text_file.h"

namespace plumbline {
namespace {

/// The store's state once the cell file is noted in it.
Result<ModelState> NoteDeclared(ModelStore& store, const std::string& cell_file) {
  const Result<std::string> text = ReadTextFile(cell_file);
  if (!text) return Error{text.error()};
  const Result<int> declared = store.Declare(*text, cell_file);
  if (!declared) return Error{declared.error()};
  return store.State();
}

}  // namespace

std::optional<ConfigInForce> ReadConfigInForce(const std::string& path, FaultList& faults,
                                               const std::string& state_directory) {
  std::optional<DaemonConfig> declared = ReadDaemonConfig(path, faults);
  if (!declared) return std::nullopt;
  const std::string asked = declared->state_directory;
  if (!state_directory.empty()) declared->state_directory = state_directory;
  const auto without_store = [&](const std::string& why) {
    faults.Add({Fault::Severity::kWarning, declared->state_directory, 0, "",
                "models are not kept, the cell file is in force: " + why});
    return ConfigInForce{std::move(*declared), asked, {}};
  };
  Result<ModelStore> store = ModelStore::Open(declared->state_directory);
  if (!store) return without_store(store.error());
  const Result<ModelState> state = NoteDeclared(store.value(), declared->cell_file);
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
    faults.Append(own);
    faults.Add({Fault::Severity::kFault, store->ModelFile(state->applied), 0, "",
                fmt::format("version {} is in force, but cannot be used; choose another by "
                            "`plumbline model rollback` or `plumbline model apply {}`",
                            state->applied, state->declared)});
    return std::nullopt;
  }
  applied->state_directory = declared->state_directory;
  return ConfigInForce{std::move(*applied), asked, *state};
}

}  // namespace plumbline
