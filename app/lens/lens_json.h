// A calibrated lens as a file: LENS.json of the public formats.
#pragma once

#include <string>
#include <string_view>

#include "app/lens/calibration.h"
#include "firmware-like/result.h"

namespace plumbline {

std::string LensJson(const LensCalibration& calibration);

/// What a tracker needs of such a file.
struct LensFile : KnownLens {
  bool accepted = false;
};

/// Reads LENS.json. Refused are missing or non-finite numbers, focal lengths that are not positive,
/// and a covariance that is none; the error names the key.
Result<LensFile> LensFromJson(std::string_view text);

}  // namespace plumbline
