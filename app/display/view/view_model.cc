#include "app/display/view/view_model.h"

#include <fmt/format.h>

#include <filesystem>

#include "app/base/config/daemon_config_reader.h"
#include "app/cell/model_store/model_store.h"
#include "drivers/files/text_file.h"

namespace plumbline::display {

std::optional<ViewModel> ReadViewModel(const std::string& path, int version,
                                       config::FaultList& faults) {
  std::optional<config::DaemonConfig> config = config::ReadDaemonConfig(path, faults);
  if (!config) return std::nullopt;
  if (version > 0) {
    const std::string file = cell::ModelStore::ModelFile(config->state_directory, version);
    const config::FileSource files = [&](const std::string& name) {
      return files::ReadTextFile(name == config->cell_file ? file : name);
    };
    const Result<std::string> text = files::ReadTextFile(path);
    config::FaultList own;
    std::optional<config::DaemonConfig> applied;
    if (text) applied = config::DaemonConfigFromText(*text, path, files, own);
    if (!applied) {
      faults.Append(own);
      faults.Add({config::Fault::Severity::kFault, file, 0, "",
                  fmt::format("model version {} is in force but cannot be read; the tool and the "
                              "assembly points are not drawn",
                              version)});
      return std::nullopt;
    }
    config = std::move(applied);
  }
  deflection::LoadedArm arm(config->machine.cell);
  return ViewModel{std::move(*config), std::move(arm), version};
}

}  // namespace plumbline::display
