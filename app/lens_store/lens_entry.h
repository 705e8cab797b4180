// A calibrated lens as it is kept.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "firmware-like/lens/known_lens.h"

namespace plumbline {

/// What a lens belongs to. Digital zoom is always off: it is never calibrated.
struct LensKey {
  std::string camera_serial;  ///< of two cameras with one serial number: with the port added
  std::string mode;           ///< format, size and rate that the camera was in
  std::int32_t zoom_counts = 0;
  std::optional<std::int32_t> focus_counts;  ///< absent where the device does not tell it
};

/// A lens as it is kept.
struct LensEntry : KnownLens {
  std::int64_t id = 0;  ///< of the store; ascending
  LensKey key;
  double rms_px = 0;                     ///< of the corners, root mean square of their distances
  std::optional<double> uncertainty_px;  ///< of the projection at its worst place, one deviation
  std::string board;                     ///< which board, in words and numbers
  /// Of the entrance pupil along the axis, against the first entry. The daemon does not measure it:
  /// each lens has a pose of the camera of its own, by the fixed marks, which holds it.
  std::optional<double> pupil_shift_m;
  std::optional<double> temp_C;       ///< of the robot, where its profile reads one
  std::string utc;                    ///< as 2026-11-21T07:30:00Z
  std::vector<std::uint8_t> corners;  ///< what the calibration needs to do it again: stored_views.h
};

/// FNV-1a over everything but the id.
std::uint64_t ChecksumOf(const LensEntry& entry);
/// As stores of schema 1 counted it: the pupil's shift always told, no uncertainty.
std::uint64_t ChecksumOfSchema1(const LensEntry& entry);

/// Why an entry must not be kept, in words: values that are not finite, focal lengths that are not
/// positive, a covariance that is not symmetric or has a negative variance, an empty image, no
/// serial, no mode. Nothing where it may.
std::optional<std::string> FaultOf(const LensEntry& entry);

}  // namespace plumbline
