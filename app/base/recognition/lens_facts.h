// What a lens file states, and whether its statements agree.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/base/recognition/recognition.h"

namespace plumbline::recognition {

/// A value and the line that shows it.
template <typename T>
struct Stated {
  T value{};
  int line = 0;
};

/// Intrinsics as a file states them [px]; what it lacks is empty.
struct LensFacts {
  std::optional<Stated<double>> width, height, fx, fy, cx, cy, skew;
  std::optional<Stated<std::vector<double>>> terms;  ///< of distortion, in the order of the file
  std::optional<Stated<std::string>> model;          ///< name of the distortion model
  /// Numbers of terms that the named model has; empty if it is unknown.
  std::vector<std::size_t> model_terms;
  bool fisheye = false;
  /// The terms are those of OpenCV, in its order, so that the polynomial can be evaluated.
  bool opencv_order = false;
};

/// Adds the facts, and contradicts: a number of terms that the model does not have, a skew, a
/// principal point outside the image, focal lengths that are not positive, and a polynomial that
/// folds back before a corner of the image.
void AddLens(const LensFacts& lens, Recognition& found);

}  // namespace plumbline::recognition
