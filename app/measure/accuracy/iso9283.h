// Performance characteristics of ISO 9283 from measured poses: accuracy, repeatability, drift.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "firmware-like/geometry/pose.h"

namespace plumbline::measure {

/// One measured row.
struct Reading {
  int pose = 0;                    ///< readings of one command pose share it
  int session = 0;                 ///< readings of one session are in the same frame
  std::optional<double> t_s{};     ///< absent if not recorded
  Vec3 attained_W = Vec3::Zero();  ///< measured tip [m]
  Vec3 error_W = Vec3::Zero();     ///< attained minus command [m]
};

/// Characteristics of one pose.
struct PoseCharacteristics {
  int pose = 0;
  int session = 0;
  int cycles = 0;
  Vec3 barycentre_W = Vec3::Zero();  ///< mean of the attained positions [m]
  Vec3 mean_error_W = Vec3::Zero();  ///< barycentre minus command [m]
  double accuracy_m = 0;             ///< AP_P, the length of `mean_error_W`
  /// RP_l = mean + 3 standard deviations of the distances from the barycentre [m]; absent with
  /// fewer than three cycles.
  std::optional<double> repeatability_m{};
  double repeatability_u_m = 0;  ///< its standard uncertainty, from the number of cycles
};

/// AD: mean attained distance between two poses minus the commanded one.
struct DistanceCharacteristics {
  std::size_t from = 0, to = 0;  ///< into Characteristics::poses
  double commanded_m = 0;
  double accuracy_m = 0;  ///< signed
};

/// dAP: change of the pose accuracy between the first and the last visit of a pose.
struct DriftCharacteristics {
  std::size_t pose = 0;  ///< into Characteristics::poses
  int first_cycles = 0, last_cycles = 0;
  std::optional<double> elapsed_s{};  ///< between the means of the two visits
  double accuracy_m = 0;              ///< |AP(last) - AP(first)|
};

struct Characteristics {
  std::vector<PoseCharacteristics> poses;  ///< in the order of their first reading
  double mean_accuracy_m = 0;              ///< of AP_P over the poses
  std::size_t worst = 0;                   ///< the pose with the largest AP_P
  /// The pose with the largest RP_l; absent if no pose has three cycles.
  std::optional<std::size_t> least_repeatable{};
  /// Standard deviation of a cycle about its pose's mean, on one axis, pooled over the poses [m],
  /// and its degrees of freedom; 0 without repeated poses.
  double cycle_sigma_m = 0;
  int cycle_degrees_of_freedom = 0;
  /// Distance accuracy of the two poses commanded farthest apart within one session; absent if
  /// there are none.
  std::optional<DistanceCharacteristics> distance{};
  /// Drift of the pose whose visits are farthest apart in time (or in readings); absent if no pose
  /// was visited again after another one.
  std::optional<DriftCharacteristics> drift{};
};

/// Characteristics of readings in measurement order; empty for no readings. If there are more than
/// 1000 poses, the distances use an evenly spaced subset of them.
Characteristics CharacteristicsOf(const std::vector<Reading>& readings);

}  // namespace plumbline::measure
