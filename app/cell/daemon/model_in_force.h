// The daemon's configuration with the applied model in place of the cell file it names.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "app/base/config/daemon_config.h"
#include "app/base/config/fault.h"
#include "app/cell/model_store/model_store.h"

namespace plumbline::cell {

/// Number of a configuration that was read; ascends, also from one start of the daemon to the next.
std::uint64_t NextGeneration();

struct ConfigInForce {
  config::DaemonConfig config;             ///< its cell is that of the applied version
  std::string configured_state_directory;  ///< as in the file; a change takes a restart
  ModelState models;  ///< all 0 if the store cannot be used; the faults say why
  /// Why an applied model is not in force, or may not be; empty if none is set aside.
  std::string set_aside;
  std::uint64_t generation = NextGeneration();
};

/// State of a running daemon that reloads its configuration.
struct RunningDaemon {
  std::string state_directory;  ///< in use since the start, even if the file has changed
  ModelState models = {};       ///< in force
  /// False if another daemon maintains the journal and the models of that directory.
  bool owns_directory = true;
};

/// Reads the configuration, records its cell file in the model store of its state directory, and
/// reads it again with the applied version if that is a different one.
///
/// If the store or the applied version cannot be used:
///   - The applied version is in the store but cannot be read: a fault, and the cell file does not
///     replace it.
///   - The store is missing, or the cell file cannot be recorded in it: a warning. If a version
///     was applied to this cell file it stays in force, otherwise the cell file is used. If the
///     cell file has been edited since, it is in force with `set_aside`.
///   - The store cannot be opened although it may hold an applied version: a fault at a reload; at
///     the start the cell file is in force with `set_aside`.
///   - At a reload the store is empty although a version of it is in force, for example because its
///     file system is no longer mounted: a fault.
///   - At the start the store is empty although the directory was used before: the cell file is in
///     force with `set_aside`, because an applied model may have been lost. Applying a version,
///     even the declared one, clears that.
///   - Another daemon owns the directory: nothing is recorded in it. Its applied version is used if
///     it belongs to the same cell; otherwise the cell file is in force with a warning.
/// @param running  nullopt at the start
/// @return  nullopt if the configuration, its files, the store or the applied version have a fault,
///          or if the daemon cannot use the applied version (ModelUnusableReason)
std::optional<ConfigInForce> ReadConfigInForce(const std::string& path, config::FaultList& faults,
                                               const std::optional<RunningDaemon>& running = {});

}  // namespace plumbline::cell
