// Option --config, by which a command names the daemon that it works on.
#pragma once

#include <string>

namespace plumbline::cli {

inline constexpr const char* kDaemonOptionText =
    "plumbline.toml of the daemon, in place of its port or state_directory";

/// How a running daemon is reached from this computer.
struct DaemonPlace {
  std::string state_directory;
  std::string host;
  int port = 0;
};

/// From its configuration. Throws CLI::ValidationError if that cannot be read or has faults.
/// @param instead  the option of the command that gives the place without a configuration, "--port"
DaemonPlace PlaceOfDaemon(const std::string& config_file, const std::string& instead);

}  // namespace plumbline::cli
