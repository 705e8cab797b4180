// Export of a lens for OpenCV's cv::FileStorage, without a dependency on OpenCV.
#pragma once

#include <string>

#include "app/lens_store/lens_entry.h"

namespace plumbline::lens_store {

/// Has the keys of OpenCV's calibration sample: calibration_time, image_width, image_height,
/// camera_matrix (3 x 3), distortion_coefficients (5 x 1: k1 k2 p1 p2 k3), avg_reprojection_error;
/// and additional ones: zoom_counts, focus_counts, camera_serial, parameter_covariance (9 x 9,
/// order of LensVector). Numbers are exact; values missing from the entry (time, camera) are
/// omitted.
std::string OpenCvYaml(const LensEntry& entry);
std::string OpenCvXml(const LensEntry& entry);

}  // namespace plumbline::lens_store
