// Snapshot: one picture of the running daemon's state, as a file.
#pragma once

#include <optional>
#include <string>

#include "firmware-like/image/image_size.h"
#include "firmware-like/lens/lens.h"

namespace plumbline::display {

struct SnapshotOptions {
  std::string config_file, out;
  image::ImageSize size{1280, 720};
  std::string camera;  ///< name, or "both"; empty: as configured
  bool json = false;
  double state_wait_s = 5, meshes_wait_s = 60;
};

/// Draws the newest state once the meshes are read and distances measured, and writes the picture.
/// @return  the exit code: 0 written, 1 faults in the configuration, 2 no daemon, no renderer, or
///          writing failed
int TakeSnapshot(const SnapshotOptions& options);

}  // namespace plumbline::display
