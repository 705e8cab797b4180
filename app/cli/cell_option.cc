#include "app/cli/cell_option.h"

#include <iostream>

#include "app/base/config/cell_reader.h"
#include "app/base/config/daemon_config_reader.h"
#include "app/base/recognition/recognition.h"
#include "app/cell/model_store/usable_model.h"
#include "drivers/files/open_failure.h"
#include "drivers/files/text_file.h"
#include "firmware-like/deflection/loaded_arm.h"

namespace plumbline::cli {

std::optional<CellInForce> ReadCellInForce(const std::string& path) {
  const Result<std::string> text = files::ReadTextFile(path);
  if (!text) {
    std::cerr << path << ": " << files::ReadErrorText(path, text.error()) << '\n';
    return std::nullopt;
  }
  config::FaultList faults;
  std::optional<CellInForce> found;
  const bool configuration =
      recognition::Recognise(*text, path).content == recognition::Content::kConfiguration;
  if (configuration) {
    if (const auto config = config::DaemonConfigFromText(*text, path, faults, 0)) {
      found = CellInForce{config->machine.cell, config->machine.limits, *text};
      if (const auto applied =
              cell::CheckModelStore(config->state_directory, config->cell_file, faults)) {
        found->cell = *applied;
      }
    }
  } else if (const auto cell = config::CellFromText(*text, path, faults)) {
    found = CellInForce{*cell, {}, *text};
  }
  std::cerr << config::FaultsText(faults);
  if (!found || faults.HasFaults()) return std::nullopt;
  found->cell = deflection::CellOfPoints(found->cell);
  return found;
}

}  // namespace plumbline::cli
