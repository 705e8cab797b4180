#include "app/cli/daemon_option.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "app/base/config/daemon_config_reader.h"
#include "app/base/config/page_config.h"

namespace plumbline::cli {

DaemonPlace PlaceOfDaemon(const std::string& config_file, const std::string& instead) {
  config::FaultList faults;
  // Without the posture check, which takes up to tens of milliseconds for each point.
  const auto config = config::ReadDaemonConfig(config_file, faults, 0);
  if (!config) {
    throw CLI::ValidationError("--config",
                               fmt::format("{0} has faults, which `plumbline check {0}` lists; fix "
                                           "them, or give {1} instead",
                                           config_file, instead));
  }
  const std::string& listen = config->plc.tcp.address;
  return {config->state_directory, config::IsWildcardAddress(listen) ? "127.0.0.1" : listen,
          config->plc.tcp.port};
}

}  // namespace plumbline::cli
