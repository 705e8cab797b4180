// Postures with the tool pose that the controller reports there.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "firmware-like/loads/gravity.h"
#include "firmware-like/model/cell_model.h"

namespace plumbline::measure {

/// How three reported numbers are an orientation: rotations about three axes, each by one of the
/// numbers, or a rotation vector.
struct AngleConvention {
  const char* name;           ///< "a_b_c"
  const char* text;           ///< "Rz(1) Ry(2) Rx(3)"
  std::array<int, 3> axes;    ///< 0: x, 1: y, 2: z, from the left; all -1: rotation vector
  std::array<int, 3> number;  ///< index of the number that each of them turns by
};

/// The conventions that are tried; the first four are those of robot profiles.
const std::vector<AngleConvention>& AngleConventions();
inline constexpr int kRotationVectorAngles = 0, kRollPitchYawAngles = 1, kAbcAngles = 2,
                     kZyzAngles = 3;

Mat3 RotationFromNumbers(const Vec3& numbers, const AngleConvention& convention);

struct ControllerPosture {
  model::JointVector q;   ///< as reported [rad] or [m]
  model::JointVector qd;  ///< velocities [rad/s] or [m/s]; empty if unknown
  Vec3 p;                 ///< reported position [m]
  Vec3 angles;            ///< reported orientation [rad], in the convention of the sample
  Mat3 R;                 ///< the same as a rotation
  std::optional<loads::Payload> payload{};  ///< absent if unknown
  std::optional<double> temp_C{}, t_s{};
  int tool = 0;                ///< index of the mounted tool
  std::optional<Pose> X_FT{};  ///< tool offset that the controller reports, in place of the tool's
  int line = 0;                ///< of its file; 0: none
  bool of_flange = false;      ///< the pose is stated to be that of the flange
};

struct ControllerSample {
  std::vector<ControllerPosture> postures;
  /// Index into AngleConventions(); -1: the orientation was given as a quaternion.
  int convention = kRotationVectorAngles;
  bool with_orientation = true;  ///< false: only positions are reported
  /// Smallest steps of the numbers: SI. Rounding to them is the noise.
  double joint_step = 0, position_step = 0, angle_step = 0;
};

/// The largest power of ten times `unit`, from 1e-7 to 100, of which all values are multiples; 0 if
/// there is none. Values that are all zero have none.
double StepOf(const std::vector<double>& values, double unit);

/// Fills the steps that are 0 from the values: joints in degrees or mrad, positions in mm, angles
/// in degrees or mrad, or in what a wrong conversion between them makes of these.
void FindSteps(ControllerSample& sample);

/// Posture of the sample that is nearest to another one, and how far: the largest change of a
/// joint.
double DistanceToNearest(const std::vector<ControllerPosture>& postures,
                         const model::JointVector& q);

}  // namespace plumbline::measure
