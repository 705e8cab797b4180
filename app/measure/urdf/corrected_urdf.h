// Corrected kinematics written into the joint origins of a URDF.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "app/measure/urdf/joint_chain.h"
#include "firmware-like/result.h"

namespace plumbline::measure {

/// A joint whose origin changes, and by how much.
struct MovedOrigin {
  std::string joint;
  Pose X_PJ;  ///< new origin
  double distance_m = 0;
  double angle_rad = 0;
};

struct CorrectedOrigins {
  std::vector<MovedOrigin> origins;
  /// Change of the tip against the last moving joint that no fixed joint can take.
  double tip_left_m = 0;
  double tip_left_rad = 0;
  Pose X_base_B;  ///< the cell's robot base in the URDF's base link
};

/// Origins with which the URDF's chain has the corrected table's kinematics:
///   URDF  O_1 A_1 Rz(q_1) A_1^-1 O_2 A_2 Rz(q_2) ...  with A_i the rotation from z to axis i
///   table K_0 Rz(q_1) K_1 Rz(q_2) ... K_n
/// Both describe the declared arm, so S_i in  A_i^-1 O_(i+1) A_(i+1) = S_i^-1 K_i S_(i+1)  commutes
/// with the motion of joint i; the corrected origins follow from the corrected K_i with the same
/// S_i. Axes and link frames other than by these origins stay.
/// @param declared   the table as it was imported from this URDF; its base pose is not used
/// @param corrected  the table with the corrections added
/// @return  the error if the declared table is not that of the URDF: more than 1 um or 1e-6 rad
///          apart over 1000 postures
Result<CorrectedOrigins> CorrectedOriginsOf(const UrdfFile& urdf, const JointChain& chain,
                                            const model::Robot& declared,
                                            const model::Robot& corrected);

/// The URDF text with new origins; everything else is kept, comments and white space included.
/// @param text  accepted by UrdfFromText()
std::string UrdfWithOrigins(std::string_view text, const std::vector<MovedOrigin>& origins);

}  // namespace plumbline::measure
