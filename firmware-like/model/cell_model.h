// Declared model of a cell: plain values in SI units, validated by the configuration reader.
#pragma once

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "firmware-like/geometry/pose.h"
#include "firmware-like/model/artefact.h"
#include "firmware-like/model/section.h"

namespace plumbline::model {

/// Largest number of joints; fixes the storage of everything used in the control cycle.
inline constexpr int kMaxJoints = 12;

/// One value per joint, first joint first: rad and N m; m and N for prismatic joints.
template <typename T>
using JointVectorOf = Eigen::Matrix<T, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxJoints, 1>;
using JointVector = JointVectorOf<double>;

/// beta is zero except between nearly parallel axes [Hayati & Mirmirani 1985]; gamma turns the
/// flange about its z axis. With both, a row of a "dh" table represents any rigid transform
/// exactly.
enum class DhConvention {
  kDistal,    ///< "dh":  T_i = Rz(theta) Tz(d) Tx(a) Rx(alpha) Ry(beta) Rz(gamma);
              ///< rotates about z of frame i-1
  kProximal,  ///< "mdh": T_i = Rx(alpha) Tx(a) Ry(beta) Rz(theta) Tz(d); rotates about z of frame i
};

enum class JointType { kRevolute, kPrismatic };

/// A joint and its link. The DH angle is theta_i = sign (q_i + s_i) + offset, with s_i the
/// deflection of the joint. A prismatic joint has d_i = sign (q_i + s_i) + d and theta_i = offset.
/// Of a coupled joint, q_i and s_i are those of its axis, see JointCoupling.
struct Joint {
  JointType type = JointType::kRevolute;
  double a_m = 0;
  double alpha_rad = 0;
  double beta_rad = 0;
  double gamma_rad = 0;  ///< 0 with DhConvention::kProximal, where theta_offset has the same effect
  double d_m = 0;
  double theta_offset_rad = 0;
  int sign = 1;
  double min =
      -std::numeric_limits<double>::infinity();  ///< limits of the reported q_i [rad] or [m]
  double max = std::numeric_limits<double>::infinity();
  std::optional<double> link_mass_kg;           ///< if absent, torques of joints 1..i are unknown
  std::optional<Vec3> link_com_m;               ///< in the link's DH frame; estimated if absent
  std::optional<double> compliance_rad_per_Nm;  ///< rigid if absent
};

/// What the drive of a coupled joint turns: where its gears wind up and carry their load.
enum class CouplingDrive {
  kAxis,     ///< the axis: the motor sits at it, and the controller only counts differently
  kReading,  ///< the reading: a motor further inboard turns the link through rods, belts or gears
};

/// A joint whose axis also turns with another joint: the controller counts it against the ground,
/// or a parallelogram or belt drives it. Joints are 0-based.
///   axis_joint = q_joint + ratio * q_of
/// [Spong, Hutchinson & Vidyasagar, Robot Modeling and Control, on remotely driven links]
struct JointCoupling {
  int joint = 0;
  int of = 0;
  double ratio = 0;  ///< [1]; [m/rad] or [rad/m] between a prismatic and a revolute joint
  CouplingDrive drive = CouplingDrive::kAxis;

  bool operator==(const JointCoupling&) const = default;
};

/// Adds ratio * q_of of each coupling that `counts` to its joint.
template <typename T, typename Counts>
JointVectorOf<T> Coupled(const std::vector<JointCoupling>& couplings, const JointVectorOf<T>& q,
                         const Counts& counts) {
  JointVectorOf<T> coupled = q;
  for (const JointCoupling& coupling : couplings) {
    if (counts(coupling)) coupled[coupling.joint] += coupling.ratio * q[coupling.of];
  }
  return coupled;
}

/// Positions of the axes from joint values q as the controller reports them:
///   axis = C q,  C = I + sum over the couplings of ratio at (joint, of)
template <typename T>
JointVectorOf<T> AxisPositions(const std::vector<JointCoupling>& couplings,
                               const JointVectorOf<T>& q) {
  return Coupled<T>(couplings, q, [](const JointCoupling&) { return true; });
}

/// Positions of the drives, d = D q, on which deflections, gear errors and torques act; D is C with
/// the couplings of CouplingDrive::kAxis only. Velocities, accelerations and moves likewise.
inline JointVector DrivePositions(const std::vector<JointCoupling>& couplings,
                                  const JointVector& q) {
  return Coupled<double>(couplings, q, [](const JointCoupling& coupling) {
    return coupling.drive == CouplingDrive::kAxis;
  });
}

/// axis = E d, with C = E D: no coupling of kReading is to a joint with one of kAxis.
inline JointVector AxesFromDrives(const std::vector<JointCoupling>& couplings,
                                  const JointVector& d) {
  return Coupled<double>(couplings, d, [](const JointCoupling& coupling) {
    return coupling.drive == CouplingDrive::kReading;
  });
}

/// E^T tau: what the torques about the axes load the drives with, by virtual work.
template <typename T>
JointVectorOf<T> DriveTorques(const std::vector<JointCoupling>& couplings,
                              const JointVectorOf<T>& tau) {
  JointVectorOf<T> of_drives = tau;
  for (const JointCoupling& coupling : couplings) {
    if (coupling.drive != CouplingDrive::kReading) continue;
    of_drives[coupling.of] += coupling.ratio * tau[coupling.joint];
  }
  return of_drives;
}

/// D^-1 times positions or deflections of the drives, in any order of the couplings.
template <typename T>
JointVectorOf<T> ReportedFromDrives(const std::vector<JointCoupling>& couplings,
                                    const JointVectorOf<T>& d) {
  JointVectorOf<T> q = d;
  // D - I is nilpotent: each pass completes one further joint of a sequence of couplings.
  for (std::size_t pass = 0; pass < couplings.size(); ++pass) {
    JointVectorOf<T> next = d;
    for (const JointCoupling& coupling : couplings) {
      if (coupling.drive != CouplingDrive::kAxis) continue;
      next[coupling.joint] -= coupling.ratio * q[coupling.of];
    }
    q = next;
  }
  return q;
}

/// Which arm it is, as its maker and its owner name it; empty where not declared. Labels: no
/// prediction depends on them.
struct ArmIdentity {
  std::string model;      ///< "KR 210 R2700-2"; arms of one model learn from each other
  std::string series;     ///< production series
  std::string installed;  ///< date, YYYY-MM-DD
};

struct Robot {
  std::string name;
  DhConvention convention = DhConvention::kDistal;
  Vec3 g_W = Vec3(0, 0, -9.80665);  ///< gravity in W [m/s^2]
  Pose X_WB;
  std::vector<Joint> joints;
  std::vector<JointCoupling> couplings{};  ///< without cycles
  ArmIdentity identity{};

  int size() const { return static_cast<int>(joints.size()); }
};

enum class BeamTheory { kEulerBernoulli, kTimoshenko };

/// A segment of the tool with one section and one material; segments are listed from the flange
/// outwards.
struct ToolSegment {
  double length_m = 0;
  Section section;
  Material material;
};

/// The tool: either rigid with a given tip, or a cantilever of segments along +z of the flange.
struct Tool {
  bool rigid = true;
  Vec3 tcp_F = Vec3::Zero();  ///< tip of a rigid tool in F [m]; for a beam (0, 0, length)
  BeamTheory theory = BeamTheory::kEulerBernoulli;
  std::vector<ToolSegment> segments;  ///< empty for a rigid tool
  double mount_mass_kg = 0;           ///< lumped at mid length; loads the joints but not the beam
  std::optional<int> number{};        ///< by which rows and the controller name it

  double Length() const {
    double length_m = 0;
    for (const ToolSegment& segment : segments) length_m += segment.length_m;
    return length_m;
  }
};

/// A body that the arm carries at times in addition to the payload, switched on by its number.
struct PayloadItem {
  int number = 1;  ///< at least 1; 0 means no item
  double mass_kg = 0;
  Vec3 cog_F = Vec3::Zero();  ///< centre of gravity in F [m]
};

enum class MeasurementKind { kPosition, kRange, kPose };

struct Measurement {
  MeasurementKind kind = MeasurementKind::kPosition;
  Vec3 anchor_W = Vec3::Zero();     ///< origin of measured ranges [m]
  bool frame_known = true;          ///< the pose of the base in W is known ("aligned")
  bool holds_points = false;        ///< with an unknown frame: the points are in it
  bool tool_known = true;           ///< the position of the tip on the flange is known
  std::optional<double> sigma_m;    ///< standard deviation per axis; if absent, from repeats
  std::optional<double> sigma_rad;  ///< the same of measured orientations, unused if absent
  std::optional<double> reference_temperature_C;
  /// Pose of the measuring camera, if a camera measures: z is the optical axis, x points right in
  /// the image.
  std::optional<Pose> X_WC;
  /// Declared positions of the reference tags [m] that rows measured by named cameras rest on. If
  /// empty, these rows are in W without error of the tags.
  std::vector<Vec3> reference_tags_W;
  double reference_sd_m = 0;  ///< standard deviation of each position, per axis; 0 without tags
};

struct Interval {
  double low = 0;
  double high = 0;
  bool Contains(double value) const { return value >= low && value <= high; }
  double Width() const { return high - low; }
  /// How far a value lies beyond the interval; 0 inside.
  double DistanceOf(double value) const {
    return value < low ? low - value : value > high ? value - high : 0;
  }
  bool operator==(const Interval&) const = default;
};

/// One parameter of a stored effect, in the unit defined by the effect catalogue.
struct EffectParameter {
  std::string name;
  double value = 0;
  std::optional<double> sd;  ///< standard deviation
  std::string unit;
  std::string word;  ///< choice instead of a value, such as `by` of backlash; else empty
};

/// An effect added to the declared model, as stored in the cell file.
struct WrittenEffect {
  std::string id;
  std::vector<std::string> scope;
  std::vector<EffectParameter> parameters;
  Eigen::MatrixXd covariance;        ///< of the numeric parameters; empty if not stated
  std::vector<std::string> drivers;  ///< of an empirical term: the columns it depends on
  Eigen::MatrixXd nodes;             ///< of an empirical term, in file units
  /// Time span of the rows to which a time-dependent effect was fitted. Outside it, the effect
  /// holds its first or last value.
  std::optional<Interval> seen_t_s;
  std::string from_file, from_date;  ///< origin: the fitted data
  std::optional<int> from_rows;
};

/// Tip of a tool in a session, in F [m].
struct SessionTip {
  std::optional<int> tool{};  ///< number of the [[tool]]; absent if the cell has one without number
  Vec3 p_F = Vec3::Zero();
  std::optional<Vec3> declared_F{};  ///< of the declared model, see SessionFrames
};

/// Base pose and tips estimated for one session of a measurement with unknown frame or tools. They
/// describe where instrument and targets were mounted, not the arm: see deflection::CellOfPoints.
struct SessionFrames {
  std::string id;
  Pose X_WB;
  std::vector<SessionTip> tips{};  ///< of the tools that the session measured, if they were free
  /// Frames of the declared model, fitted to the same rows. The arm's frames blend into these as
  /// the correction fades with distance.
  std::optional<Pose> X_WB_declared{};
};

/// The values that an input of the model had in the fitted rows.
struct MeasuredRange {
  std::vector<Interval> intervals;  ///< ascending and disjoint; one for values without large gaps
  /// Standard deviation per axis that the error gains per unit of distance from the nearest of
  /// these values [m/unit]; absent if it is not known.
  std::optional<double> growth{};

  bool operator==(const MeasuredRange&) const = default;
  Interval Hull() const { return {intervals.front().low, intervals.back().high}; }
  /// The interval nearest to a value.
  const Interval& Nearest(double value) const {
    const Interval* nearest = &intervals.front();
    for (const Interval& other : intervals) {
      if (other.DistanceOf(value) < nearest->DistanceOf(value)) nearest = &other;
    }
    return *nearest;
  }
};

/// The gravity torques of a joint in the fitted rows, in N m, or its forces in N if it is
/// prismatic. They include 0, at which no joint yields.
struct MeasuredTorque {
  int joint = 0;  ///< 0-based
  MeasuredRange range;

  bool operator==(const MeasuredTorque&) const = default;
};

/// The domain covered by the data of a fit; predictions outside it are extrapolated.
struct Domain {
  std::vector<Interval> q;  ///< [rad] or [m], one per joint
  /// Payload, temperature and time of the fitted rows. Without `payload_kg`, the rows did not
  /// record their loads. `t_s` is present only if the error grows with time.
  std::optional<MeasuredRange> payload_kg, temp_C, t_s;
  std::vector<MeasuredTorque> torques{};  ///< of the joints whose torque is known
  /// Length of the largest residual that the declared model leaves in the fitted rows [m]. A model
  /// explains residuals of this size, so that moving a point much farther contradicts its data.
  std::optional<double> largest_residual_m{};
  /// Standard deviation per axis of the residual of held-out rows at the measured poses, instrument
  /// noise included.
  std::optional<double> residual_sigma_m;
  /// Its growth per radian of distance from `poses`; see deflection/error_growth.h.
  std::optional<double> distant_sigma_m;
  /// Factor applied to the sum of the effects' covariances. Each effect is written with its own
  /// covariance only; the sum overstates the uncertainty of effects that are nearly collinear.
  double covariance_share = 1;
  std::vector<JointVector> poses;  ///< representative subset of the measured poses [rad] or [m]
  /// Growth along the joints beyond their ranges `q`, per radian or metre and weighted by
  /// their levers; see deflection/error_growth.h.
  std::optional<double> range_growth_m{};
  /// Distance from `poses` within which all measured poses lie; the error grows only beyond it.
  double reach_rad = 0;
  /// Standard deviation per axis of the declared model's error. Present if the causes of the
  /// correction are not confirmed; the correction then fades with distance towards the declared
  /// model, see deflection/error_growth.h.
  std::optional<double> declared_sigma_m;
  /// Share of such a correction that is applied at the measured poses, 0..1.
  double applied_share = 1;
  /// UTC time, in seconds since 1970, at which t_s of the fitted rows is zero. Absent if unknown;
  /// time-dependent effects are then meaningless outside those rows.
  std::optional<double> time_zero_s;
  /// False if the model was changed after its fit; the residual then belongs to another model.
  bool as_validated = true;
  std::vector<int> tools{};  ///< numbers of the tools in the fitted rows; empty: one, unnumbered
  /// Numbers of the payload items in the fitted rows, 0 for rows without one. Absent if the fit
  /// states nothing about items, so every item is outside.
  std::optional<std::vector<int>> payload_items{};
};

struct CellModel {
  Robot robot;
  Tool tool;                          ///< the only tool, or the first
  std::vector<Tool> further_tools;    ///< the others; each tool then has a number
  std::optional<Vec3> payload_cog_F;  ///< if absent, a payload mass cannot be used
  std::vector<PayloadItem> payload_items;
  Measurement measurement;
  std::vector<Artefact> artefacts;
  std::vector<KnownDistance> distances;
  std::vector<WrittenEffect> effects;
  std::vector<SessionFrames> sessions;
  std::optional<Domain> domain;

  int tools() const { return 1 + static_cast<int>(further_tools.size()); }
  /// @param index  0 for `tool`, k for the k-th of `further_tools`
  const Tool& ToolAt(int index) const {
    return index == 0 ? tool : further_tools[static_cast<std::size_t>(index - 1)];
  }
  Tool& ToolAt(int index) {
    return index == 0 ? tool : further_tools[static_cast<std::size_t>(index - 1)];
  }
  bool any_tool_bends() const {
    for (const Tool& other : further_tools) {
      if (!other.rigid) return true;
    }
    return !tool.rigid;
  }
};

}  // namespace plumbline::model
