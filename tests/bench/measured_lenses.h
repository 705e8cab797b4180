// Lens calibration on captures of real boards: acceptance, and held-out reprojection beside OpenCV
// and mrcal.
#pragma once

namespace plumbline::bench {

/// Leaves out one image after the other, calibrates on the rest, locates the board in the image
/// left out by every other corner and compares the remaining corners. Prints, for each capture,
/// whether it is accepted and where it is usable, and the RMS distance per corner of each program
/// with the ratio to OpenCV's five-parameter lens.
void MeasuredLenses();

}  // namespace plumbline::bench
