// One picture from the running daemon.
#pragma once

#include <optional>
#include <string>

#include "firmware-like/lens/lens.h"

namespace plumbline {

struct SnapshotOptions {
  std::string config_file, out;
  ImageSize size{1280, 720};
  std::string camera;  ///< name, or "both"; empty: as the configuration says
  bool json = false;
  double state_wait_s = 5, meshes_wait_s = 60;
};

/// Draws the newest state once the meshes are read and distances measured, and writes it.
/// @return the process's exit code: 0 written, 1 faults in the configuration, 2 no daemon, nothing
///         to draw with, or the file cannot be written
int TakeSnapshot(const SnapshotOptions& options);

}  // namespace plumbline
