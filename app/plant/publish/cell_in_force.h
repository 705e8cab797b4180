// The cell as its points are corrected: text and fingerprint of the model in force.
#pragma once

#include <string>

#include "app/base/config/daemon_config.h"
#include "firmware-like/result.h"

namespace plumbline::plant {

struct CellInForce {
  int model = 0;            ///< version in force; 0: the cell file itself
  std::string text;         ///< of the cell file, or of the model's file, which names its effects
  std::string fingerprint;  ///< see config::ModelFingerprint
};

/// Reads the file of the version that the daemon reports, without opening the model store.
/// @return  or why the file cannot be read or parsed
Result<CellInForce> ReadCellInForce(const config::DaemonConfig& config, int version);

}  // namespace plumbline::plant
