// Joints whose residual follows the size of their torque, as if their compliance depended on the
// direction of the load.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/measure/diagnosis/result/opinion.h"
#include "app/measure/diagnosis/search/identify.h"

namespace plumbline::measure {

/// Test of the term a |tau| beside the compliance c tau of a joint:
///   s = (c + a) tau if tau > 0, (c - a) tau if tau < 0
/// with tau the gravity torque; friction on arrivals from one side looks alike. t is the estimate
/// of a over its standard deviation, that of independent rows or the one by the scatter of the
/// poses, whichever is larger [K. Liang, S. Zeger, Biometrika 73 (1986) 13]. All rows count, with
/// equal weights: those that contradict one compliance may have been rejected as outliers. So that
/// no single pose decides, t is the least of those with one pose left out; the other columns are
/// not fitted again.
struct LoadDirection {
  /// The joints tested, 0-based. A joint whose torque has one direction in all rows is not: these
  /// rows cannot show how it yields in the other.
  std::vector<int> tested{};
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

/// The check `load_direction`, if a compliance is named. If it fails, one compliance does not
/// explain the joint's deflection: the answer is `unknown`.
Opinion OpinionOnLoadDirection(const Identified& found);

}  // namespace plumbline::measure
