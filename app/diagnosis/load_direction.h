// Joints whose compliance depends on the direction of their load, which no effect of the catalogue
// describes.
#pragma once

#include <optional>
#include <string>

#include "app/diagnosis/identify.h"

namespace plumbline::diagnosis {

/// Test of the term a |tau| beside the compliance c tau of a joint:
///   s = (c + a) tau if tau > 0, (c - a) tau if tau < 0
/// with tau the gravity torque. t is the estimate of a over its standard deviation. All rows count,
/// with equal weights: those that contradict one compliance may have been rejected as outliers. So
/// that no single pose decides, t is the least of those without each pose (replicates left out
/// together).
struct LoadDirection {
  std::string effect;   ///< id of the effect that names the compliance
  int joint = 0;        ///< 0-based
  double t = 0;         ///< absolute value
  double limit = 0;     ///< of t: kLoadDirectionSignificance over all joints tested
  double positive = 0;  ///< compliance under a positive torque [rad/(N m)]
  double negative = 0;  ///< under a negative one

  bool significant() const { return t > limit; }
};

/// The joint with the largest t among the revolute joints with a named compliance; nullopt if there
/// is none, or if the rows cannot show a for any of them.
std::optional<LoadDirection> LargestLoadDirection(const Identified& found);

}  // namespace plumbline::diagnosis
