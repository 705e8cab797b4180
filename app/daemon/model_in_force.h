// The configuration with the model that was applied, in place of the cell file it names.
#pragma once

#include <optional>
#include <string>

#include "app/config/daemon_config.h"
#include "app/config/fault.h"
#include "app/model_store/model_store.h"

namespace plumbline {

struct ConfigInForce {
  DaemonConfig config;                ///< its cell is the applied version's
  std::string asked_state_directory;  ///< what the file says; another one needs a restart
  ModelState models;  ///< all 0 where the store cannot be used; that is among the faults
  /// Why an applied model is not in force, or may not be; empty where none is set aside.
  std::string set_aside;
};

/// A daemon that reads its configuration again.
struct DaemonAtWork {
  std::string state_directory;  ///< that it started with, in place of what the file says now
  ModelState models = {};       ///< in force
  /// False: another daemon keeps the journal and the models of that directory.
  bool owns_directory = true;
};

/// Reads the configuration, notes its cell file in the model store of its state directory, and
/// reads it once more with the applied version where that is another one.
///
/// What the store holds and cannot be read is never replaced by the cell file: that is a fault. A
/// store that is not there, or that cannot be written, is a warning: the cell file is in force
/// then, or the version that was applied to it. Two cases are faults at a reload, while at the
/// start the cell file serves, with `set_aside`: a store that cannot be opened although it may hold
/// an applied version, and one that has become empty since a version of it came into force, as when
/// its file system is no longer mounted. Nothing is noted in a directory that another daemon owns:
/// its applied version serves the same cell and no other.
/// Where the store holds no version at the start although the directory was used before, the cell
/// file is in force with `set_aside`: an applied model may have been lost. A version that is
/// applied clears it, the declared one, too.
/// @param at_work  nothing at the start
/// @return nothing where the configuration, its files, the store or the applied version have a
/// fault, or where the daemon cannot use the applied version (WhyNotUsable)
std::optional<ConfigInForce> ReadConfigInForce(const std::string& path, FaultList& faults,
                                               const std::optional<DaemonAtWork>& at_work = {});

}  // namespace plumbline
