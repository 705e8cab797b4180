#include "app/cli/daemon_option.h"

#include <CLI/CLI.hpp>

#include "app/config/daemon_config_reader.h"
#include "app/config/page_config.h"

namespace plumbline::cli {

DaemonPlace PlaceOfDaemon(const std::string& config_file) {
  config::FaultList faults;
  const auto config = config::ReadDaemonConfig(config_file, faults);
  if (!config) {
    throw CLI::ValidationError("--config",
                               config_file + " has faults, which plumbline check lists");
  }
  const std::string& listen = config->plc.tcp.address;
  return {config->state_directory, config::IsWildcardAddress(listen) ? "127.0.0.1" : listen,
          config->plc.tcp.port};
}

}  // namespace plumbline::cli
