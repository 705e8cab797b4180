// What a cell is declared to be: plain values in SI, validated by the configuration reader.
#pragma once

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "firmware-like/geometry/pose.h"
#include "firmware-like/model/section.h"

namespace plumbline {

/// Most joints an arm may have; fixes the storage of everything the cycle touches.
inline constexpr int kMaxJoints = 12;

/// One value a joint, first joint first: rad and N m (m and N where the joint is prismatic).
using JointVector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxJoints, 1>;

enum class DhConvention {
  kDistal,    ///< "dh":  T_i = Rz(theta) Tz(d) Tx(a) Rx(alpha); turns about z of the frame before
  kProximal,  ///< "mdh": T_i = Rx(alpha) Tx(a) Rz(theta) Tz(d); turns about z of its own frame
};

enum class JointType { kRevolute, kPrismatic };

/// A joint and the link that follows it. DH angle theta_i = sign (q_i + s_i) + offset, s_i the
/// joint's deflection; a prismatic joint has d_i = sign (q_i + s_i) + d, theta_i = offset.
struct Joint {
  JointType type = JointType::kRevolute;
  double a_m = 0;
  double alpha_rad = 0;
  double d_m = 0;
  double theta_offset_rad = 0;
  int sign = 1;
  double min = -std::numeric_limits<double>::infinity();  ///< [rad] or [m], controller's count
  double max = std::numeric_limits<double>::infinity();
  std::optional<double> link_mass_kg;           ///< absent: torques of joints 1..i are unknown
  std::optional<Vec3> link_com_m;               ///< in the frame after the joint; absent: a guess
  std::optional<double> compliance_rad_per_Nm;  ///< absent: rigid
};

struct Robot {
  std::string name;
  DhConvention convention = DhConvention::kDistal;
  Vec3 g_W = Vec3(0, 0, -9.80665);  ///< gravity in W [m/s^2]
  Pose X_WB;
  std::vector<Joint> joints;

  int size() const { return static_cast<int>(joints.size()); }
};

enum class BeamTheory { kEulerBernoulli, kTimoshenko };

/// A stretch of the tool with one section and one material, from the flange outwards.
struct ToolSegment {
  double length_m = 0;
  Section section;
  Material material;
};

/// The tool: rigid with its centre point, or a cantilever of segments along +z of the flange.
struct Tool {
  bool rigid = true;
  Vec3 tcp_F = Vec3::Zero();  ///< tip of a rigid tool in F [m]; for a beam (0, 0, length)
  BeamTheory theory = BeamTheory::kEulerBernoulli;
  std::vector<ToolSegment> segments;  ///< empty for a rigid tool
  double mount_mass_kg = 0;           ///< lumped at mid length; loads the joints, not the tool

  double Length() const {
    double length_m = 0;
    for (const ToolSegment& segment : segments) length_m += segment.length_m;
    return length_m;
  }
};

enum class MeasurementKind { kPosition, kRange, kPose };

struct Measurement {
  MeasurementKind kind = MeasurementKind::kPosition;
  Vec3 anchor_W = Vec3::Zero();  ///< of a range [m]
  bool frame_known = true;       ///< "aligned"
  bool tool_known = true;
  std::optional<double> sigma_m;  ///< one axis; absent: estimated from repeats
  std::optional<double> reference_temperature_C;
  /// The camera that measures, where one does: z is its optical axis, x to the image's right.
  std::optional<Pose> X_WC;
};

struct Interval {
  double low = 0;
  double high = 0;
  bool Contains(double value) const { return value >= low && value <= high; }
};

/// One parameter of a written effect, in the unit that the catalogue fixes for it.
struct EffectParameter {
  std::string name;
  double value = 0;
  std::optional<double> sd;
  std::string unit;
  std::string word;  ///< in place of a value: `by` of backlash, `frame` of step_event; else empty
};

/// An effect added to the declared model, as the diagnosis writes it.
struct WrittenEffect {
  std::string id;
  std::vector<std::string> scope;
  std::vector<EffectParameter> parameters;
  Eigen::MatrixXd covariance;        ///< of the parameters that are numbers; empty where not told
  std::vector<std::string> drivers;  ///< of an empirical term: the columns that it follows
  Eigen::MatrixXd nodes;             ///< of an empirical term, as written
  /// Of an effect that follows the time: the times of the rows it was fitted to. Before and after
  /// them it keeps its first and its last value.
  std::optional<Interval> seen_t_s;
  std::string from_file, from_date;
  std::optional<int> from_rows;
};

/// Base and tip as estimated for one session of an unaligned or unknown measurement.
struct SessionFrames {
  std::string id;
  Pose X_WB;
  std::optional<Vec3> tip_F;
  /// Where the correction fades with the distance: the frames of the declared model, fitted to the
  /// same rows. The arm's frames go over to them as the correction fades.
  std::optional<Pose> X_WB_declared{};
  std::optional<Vec3> tip_declared_F{};
};

/// What a fit has seen; outside it a prediction is extrapolated.
struct Domain {
  std::vector<Interval> q;  ///< [rad] or [m], one a joint
  std::optional<Interval> payload_kg;
  /// The loads measured, ascending, where they are too few (see OutsideDomain) to show that what
  /// deflects is in proportion to the load; empty: any load within `payload_kg` is seen.
  std::vector<double> payload_levels_kg;
  std::optional<Interval> temp_C;
  /// One axis, noise included: of rows held out, at the measured poses.
  std::optional<double> residual_sigma_m;
  /// What a distance of one radian from the measured poses adds to it in squares, one axis:
  ///   sigma^2(d) = residual_sigma^2 + (distant_sigma d)^2, d by kinematics/pose_distance.h.
  /// Absent: it is the same everywhere.
  std::optional<double> distant_sigma_m;
  /// In which the covariances of the effects, each written by itself, count in the radius: what
  /// effects that do nearly the same leave open of each other they do not leave open together.
  double covariance_share = 1;
  std::vector<JointVector> poses;  ///< some of those measured, spread over them [rad] or [m]
  /// Distance from `poses` within which every measured pose lies, and the error does not grow yet.
  double reach_rad = 0;
  /// Absent where the causes of the correction are confirmed. Else the correction fades with the
  /// distance, towards the declared model that errs by so much on one axis; see distance_growth.h.
  std::optional<double> declared_sigma_m;
  /// Where the t_s of its rows began to count, UTC in seconds since 1970; absent: not known, and
  /// effects of time mean nothing elsewhere than on those rows.
  std::optional<double> time_zero_s;
  /// False: the model was changed after its fit, so that the residual is that of another model.
  bool as_validated = true;
};

struct CellModel {
  Robot robot;
  Tool tool;
  std::optional<Vec3> payload_cog_F;  ///< absent: a payload mass cannot be used
  Measurement measurement;
  std::vector<WrittenEffect> effects;
  std::vector<SessionFrames> sessions;
  std::optional<Domain> domain;
};

}  // namespace plumbline
