// Dynamic deflection: displacement of the tip caused by the acceleration of the arm.
#pragma once

#include "firmware-like/deflection/loaded_arm.h"
#include "firmware-like/motion/joint_motion.h"

namespace plumbline::motion {

/// Displacement caused by the motion, in addition to that caused by weight.
struct DynamicDeflection {
  model::JointVector sag;                      ///< joint deflections [rad] or [m]
  Vec3 acceleration_F = Vec3::Zero();          ///< of the flange [m/s^2]
  Vec3 angular_acceleration_F = Vec3::Zero();  ///< of the flange [rad/s^2]
  Vec3 tip_acceleration_W = Vec3::Zero();      ///< of the tip of the rigid arm [m/s^2]
  Vec3 tip_W = Vec3::Zero();                   ///< displacement of the tip [m]
};

/// Quasi-static deflection under the inertial forces of links, tool and payload (d'Alembert):
///   f_k = -m_k a_k                                       inertial force of mass k
///   tau_i = axis_i . sum_k (p_k - o_i) x f_k             [Craig, ch. 6, outward and inward passes]
///   s_i = (c_i + compliance from effects) tau_i          or, if an effect of the cell states how
///                                                        the joint deflects under acceleration,
///                                                        s_i of that effect instead
///   d_F = bending of the tool under f_payload, its moment, and its own inertia (beam/beam.h)
///   tip_W = R_WB (J s + R_BF d_F)
/// Links are point masses at their centres of mass, because a cell states no rotary inertias. The
/// tool's own mass is distributed. Structural compliance of links and pedestal is not included.
/// Valid well below the first natural frequency of arm and tool: an oscillation after a stop does
/// not show in the joint positions and is not computed.
class DynamicModel {
 public:
  /// @param cell  the cell that the arms passed later are built from
  explicit DynamicModel(const model::CellModel& cell);

  /// Deflection under the accelerations, with the effects of the cell. Does not allocate.
  /// @param conditions  as for LoadedArm
  /// @param covariance  out: of tip_W [m^2], from that of the accelerations
  DynamicDeflection At(const deflection::LoadedArm& arm, const JointMotion& motion,
                       const loads::Payload& payload, const effects::Conditions& conditions,
                       Mat3& covariance) const;

 private:
  struct Mass {
    double kg = 0;
    Vec3 at_F = Vec3::Zero();
  };
  /// Everything that does not depend on speeds and accelerations.
  struct Setting {
    const deflection::LoadedArm& arm;
    loads::Payload payload;
    kinematics::Posture posture = {};
    kinematics::Jacobian tip_jacobian = {};
    effects::Influence<double> influence = {};
    model::JointVector turn_s2 = {};  ///< joint deflection per acceleration from effects; 0 if none
  };
  DynamicDeflection Respond(const Setting& setting, const model::JointVector& qd,
                            const model::JointVector& qdd) const;
  /// Bending of the tool, tip displacement in F [m].
  Vec3 Bend(const Setting& setting, const DynamicDeflection& flange, const Vec3& omega_F) const;

  struct ToolModel {
    std::vector<Mass> masses;  ///< point masses equivalent to the tool, without payload
    bool bends = false;
    double shear_m_per_N = 0;
    Mat3 turned_bend = Mat3::Zero();  ///< tip [m] per angular acceleration
  };
  static ToolModel ModelOf(const model::Tool& tool);
  const ToolModel& Tool(const loads::Payload& payload) const { return tools_[payload.tool]; }
  std::vector<ToolModel> tools_;
};

}  // namespace plumbline::motion
