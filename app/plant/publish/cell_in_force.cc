#include "app/plant/publish/cell_in_force.h"

#include <fmt/format.h>

#include "app/base/config/model_fingerprint.h"
#include "app/cell/model_store/model_store.h"
#include "drivers/files/open_failure.h"
#include "drivers/files/text_file.h"

namespace plumbline::plant {

Result<CellInForce> ReadCellInForce(const config::DaemonConfig& config, int version) {
  const std::string path =
      version > 0 ? cell::ModelStore::ModelFile(config.state_directory, version) : config.cell_file;
  const Result<std::string> text = files::ReadTextFile(path);
  if (!text) return Error{fmt::format("{}: {}", path, files::ReadErrorText(path, text.error()))};
  config::FaultList faults;
  const config::TomlDocument document(*text, path, faults);
  if (!document.parsed()) return Error{config::FaultsText(faults)};
  return CellInForce{version, *text, config::ModelFingerprint(document)};
}

}  // namespace plumbline::plant
