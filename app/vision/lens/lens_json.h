// JSON file of a calibrated lens (LENS.json of the public formats).
#pragma once

#include <string>
#include <string_view>

#include "app/vision/lens/calibration.h"
#include "firmware-like/result.h"

namespace plumbline::vision {

std::string LensJson(const LensCalibration& calibration);

/// The part of the file that is read back.
struct LensFile : lens::KnownLens {
  bool accepted = false;
};

/// Reads LENS.json.
/// @return  an error that names the key if a number is missing or not finite, a focal length is not
///          positive, or the covariance is invalid
Result<LensFile> LensFromJson(std::string_view text);

}  // namespace plumbline::vision
