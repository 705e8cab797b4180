// Camera parameter file of ARToolKit, camera_para.dat. Pure.
#pragma once

#include <string>
#include <string_view>

#include "firmware-like/lens/known_lens.h"
#include "firmware-like/result.h"

namespace plumbline::vision {

/// The file holds, big-endian: width and height (int32), a 3 x 4 projection matrix and the
/// distortion factors (float64). The version of the distortion model follows from the file's size:
///   4, 176 bytes: k1 k2 p1 p2 fx fy cx cy s
///   5, 240 bytes: k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4 fx fy cx cy s
/// with the coefficients of OpenCV and s a scale of the undistorted image, which does not affect
/// the mapping of directions to pixels. [artoolkitX, param.h and paramFile.c]
bool IsArToolKitFile(std::string_view bytes);

/// @return  an error if the version is older, a number is not finite, or the focal length or the
///          image size is not positive
Result<lens::KnownLens> LensFromArToolKit(std::string_view bytes);

/// Version 4 if only k1, k2, p1, p2 are not zero, otherwise version 5, with s = 1. The covariance
/// is not stored.
/// @return  an error for a fisheye and for a lens with a usable region, since the file can hold
///          neither
Result<std::string> ArToolKitBytes(const lens::KnownLens& lens);

}  // namespace plumbline::vision
