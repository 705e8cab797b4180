// Entry of the lens store: a calibrated lens with its key and provenance.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "app/base/target/declared_facts.h"
#include "firmware-like/lens/known_lens.h"

namespace plumbline::vision {

/// Camera and zoom that a lens belongs to. Digital zoom is always off: it is never calibrated.
struct LensKey {
  std::string camera_serial;  ///< if two cameras share a serial number, the port is appended
  std::string mode;           ///< format, size and frame rate of the camera
  std::int32_t zoom_counts = 0;
  std::optional<std::int32_t> focus_counts;  ///< absent if the device does not report focus
};

struct LensEntry : lens::KnownLens {
  std::int64_t id = 0;  ///< assigned by the store, ascending
  LensKey key;
  double rms_px = 0;                     ///< reprojection error, RMS distance per corner
  std::optional<double> uncertainty_px;  ///< worst projection uncertainty in the image, 1 sd
  std::string board;                     ///< description of the board
  target::DeclaredFacts declared{};      ///< on which the uncertainty rests
  /// Shift of the entrance pupil along the axis relative to the first entry. Not measured by the
  /// daemon: each lens has its own camera pose from the reference tags, which absorbs it.
  std::optional<double> pupil_shift_m;
  std::optional<double> temp_C;       ///< of the robot, if its profile provides one
  std::string utc;                    ///< like 2026-11-21T07:30:00Z
  std::vector<std::uint8_t> corners;  ///< the views, for solving again: stored_views.h
};

/// FNV-1a over everything but the id.
std::uint64_t ChecksumOf(const LensEntry& entry);

/// Why an entry is invalid: values that are not finite, non-positive focal lengths, a covariance
/// that is not symmetric or has a negative variance, an empty image, a missing serial number or
/// mode.
/// @return  nullopt if the entry is valid
std::optional<std::string> FaultOf(const LensEntry& entry);

}  // namespace plumbline::vision
