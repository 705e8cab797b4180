// The configuration and the model that the daemon works with, as the viewer reads them.
#pragma once

#include <optional>
#include <string>

#include "app/config/daemon_config.h"
#include "app/config/fault.h"
#include "firmware-like/deflection/loaded_arm.h"

namespace plumbline {

struct ViewModel {
  DaemonConfig config;
  LoadedArm arm;
  int version = 0;  ///< of the model store; 0: the cell file
};

/// Reads the configuration with the version of the model that the daemon says is in force, and
/// writes nothing: the store is the daemon's.
/// @param version  ViewState::model_version; 0: the cell file that the configuration names
/// @return         nothing where the configuration, its files or that version has a fault
std::optional<ViewModel> ReadViewModel(const std::string& path, int version, FaultList& faults);

}  // namespace plumbline
