// Configuration and cell model in force, as read by the viewer.
#pragma once

#include <optional>
#include <string>

#include "app/base/config/daemon_config.h"
#include "app/base/config/fault.h"
#include "firmware-like/deflection/loaded_arm.h"

namespace plumbline::display {

struct ViewModel {
  config::DaemonConfig config;
  deflection::LoadedArm arm;
  int version = 0;  ///< in the model store; 0: the cell file
};

/// Reads the configuration with the model version that the daemon reports as in force. Writes
/// nothing: the model store belongs to the daemon.
/// @param version  cell::ViewState::model_version; 0 for the cell file named by the
///                 configuration
/// @return         nullopt if the configuration, a file it names or that version has a fault
std::optional<ViewModel> ReadViewModel(const std::string& path, int version,
                                       config::FaultList& faults);

}  // namespace plumbline::display
