// Where a fitted model was measured, and how its error grows with the distance from there.
#pragma once

#include <optional>
#include <vector>

#include "firmware-like/kinematics/pose_distance.h"
#include "firmware-like/model/cell_model.h"

namespace plumbline::deflection {

/// Where and under what conditions the tip is predicted. What is absent or empty is unknown.
struct OperatingPoint {
  model::JointVector q;  ///< commanded [rad] or [m]
  std::optional<double> payload_kg{};
  std::optional<double> temp_C{};
  std::optional<double> t_s{};
  int tool = 0;              ///< index, see CellModel::ToolAt
  int item = 0;              ///< number of the payload item, or 0 for none
  model::JointVector tau{};  ///< gravity torques [N m], or forces [N] of prismatic joints
};

/// An input beyond what the fitted rows show.
struct DomainExit {
  enum class Input {
    kJoint,           ///< its position [rad] or [m]
    kPosture,         ///< its distance from the nearest measured one [rad]
    kTorque,          ///< gravity torque of a joint [N m] or [N]
    kPayload,         ///< [kg]
    kLoadUnrecorded,  ///< a payload [kg], although the fitted rows did not record theirs
    kTemperature,     ///< [degC]
    kTime,            ///< [s]
    kTimeUnknown,     ///< although the error grows with time
    kTool,
    kItem,
  };
  Input input = Input::kJoint;
  std::size_t index = 0;  ///< joint, from 0
  double value = 0;
  model::Interval range{};  ///< the nearest that was measured; of a posture: 0 to its reach
  /// Variance per axis that the distance adds [m^2]; absent if how the error grows along this input
  /// is not known.
  std::optional<double> variance_m2{};
};

/// Predictive variance of a fitted model: a point is predicted by what was measured nearest to it,
/// and the deviation that the model lacks is a process with stationary increments and independent
/// contributions of each input,
///   E^2 = g_q^2 max(0, d^2 - r^2) + g_b^2 sum_j (l_j b_j)^2 + sum_j g_j^2 h_j^2
///         + g_m^2 h_m^2 + g_T^2 h_T^2 + g_t^2 h_t^2
/// per axis, with d the distance of the posture from the fitted ones (pose_distance.h), r their
/// reach, b_j how far joint j is beyond its fitted range (DistanceBeyond), l_j its lever over the
/// longest (PoseDistance::lever), and h the distances of each joint's gravity torque, the payload,
/// the temperature and the time from the nearest value that was measured [a quadratic variogram
/// with the nearest neighbour as predictor; Cressie, Statistics for Spatial Data (1993), ch. 2.3].
/// The growths g belong to the fit (Domain). The variance of a new point is residual_sigma^2 + E^2.
///
/// Fading. A correction with confirmed causes is applied everywhere: share 1. Otherwise let S^2 be
/// the variance that the declared model leaves (Domain::declared_sigma). If the error e of the
/// correction c = y + e is independent of the deviation y to be corrected, the best share is
///   S^2 / (S^2 + E^2)
/// in the least mean square sense, and the remaining variance is E^2 S^2 / (S^2 + E^2), below that
/// of no correction [linear minimum mean square estimate; Kay, Fundamentals of Statistical Signal
/// Processing I (1993), ch. 12]. At the measured poses, Domain::applied_share of it is applied;
/// residual_sigma is that of this share. All hold on average over points, not for each cell:
/// tests/evaluation/other_regions.py and outside.py count where it fails. Nothing of such a
/// correction is left for a tool, an item or a kind of load that was not measured at all.
///
/// Allocates only on construction, except Exits().
class ErrorGrowth {
 public:
  /// @param tip_F  tip in the flange frame, for the distance of postures [m]
  /// @param cell   without a domain, the only inputs are the joints, within their limits
  ErrorGrowth(const kinematics::Chain& chain, const Vec3& tip_F, const model::CellModel& cell);

  bool fades() const { return declared_m2_ > 0 || applied_share_ < 1; }
  /// Share of the correction that is applied.
  double Share(const OperatingPoint& at) const;
  /// Variance per axis added at a point, fading included [m^2].
  double Variance(const OperatingPoint& at) const;
  /// True if the variance says all that is known of the error at a point: each input that is beyond
  /// the fitted rows has a growth, and the growth is stated at all.
  bool Describes(const OperatingPoint& at) const;
  /// True if the point is extrapolated: what is assumed beyond the measured values dominates its
  /// variance, E^2 > residual_sigma^2, or how the error grows is not known.
  bool Outside(const OperatingPoint& at) const;
  /// The inputs that make a point extrapolated, those without a growth first; then, if the variance
  /// does, those that add a quarter of the largest or more. Empty if it is not extrapolated.
  std::vector<DomainExit> Exits(const OperatingPoint& at) const;

 private:
  /// What the inputs beyond the fitted rows add to the variance.
  struct Growth {
    double m2 = 0;        ///< E^2
    bool known = true;    ///< each of them has a growth
    bool covered = true;  ///< the fitted rows had this tool, item and kind of load
  };
  template <typename Visit>
  void VisitExits(const OperatingPoint& at, Visit visit) const;
  Growth GrowthAt(const OperatingPoint& at) const;
  /// Share of what is applied at the measured poses.
  double Kept(const Growth& growth) const;
  bool Dominates(double gained_m2) const;

  std::vector<model::Interval> q_;  ///< of the fitted rows; without a domain, the limits
  std::vector<bool>
      turns_;  ///< joints of which a whole turn is the same posture; limits count turns
  std::optional<model::Domain> domain_;
  std::vector<std::optional<int>> tools_;  ///< number of each
  kinematics::PoseDistance distance_;
  double declared_m2_ = 0;    ///< S^2; 0 for a confirmed correction
  double applied_share_ = 1;  ///< at the measured poses
};

/// False if the cell has a domain and no fitted row had this tool. @param tool  index
bool ToolCovered(const model::CellModel& cell, int tool);

/// False if the cell has a domain and no fitted row carried this payload item, or, for an item
/// other than 0, if the domain does not name the items of the fitted rows. @param item  number; 0:
/// none
bool ItemCovered(const model::CellModel& cell, int item);

}  // namespace plumbline::deflection
