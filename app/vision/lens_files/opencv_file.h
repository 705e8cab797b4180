// Export of a lens for OpenCV's cv::FileStorage, without a dependency on OpenCV.
#pragma once

#include <string>

#include "app/vision/lens_store/lens_entry.h"

namespace plumbline::vision {

/// Has the keys of OpenCV's calibration sample: calibration_time, image_width, image_height,
/// camera_matrix (3 x 3), distortion_coefficients (5, 8 or 12 x 1 in OpenCV's order; 4 x 1 for
/// cv::fisheye, with fisheye: 1), avg_reprojection_error; and additional ones: zoom_counts,
/// focus_counts, camera_serial, declared ("no_window, fixed_focus") if anything is,
/// usable_radius_px if the lens is not trusted in the whole image, and parameter_covariance (order
/// of LensVector: 9 x 9, or 16 x 16 with more than five coefficients). Numbers are exact; values
/// missing from the entry (time, camera) are omitted.
std::string OpenCvYaml(const LensEntry& entry);
std::string OpenCvXml(const LensEntry& entry);

}  // namespace plumbline::vision
