// Gravity torques on the joints' drives due to links, tool and payload.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "firmware-like/kinematics/chain.h"

namespace plumbline::loads {

/// Load at the flange: the mounted tool, and what is carried in addition to it.
template <typename T>
struct PayloadOf {
  T mass_kg = T(0);                     ///< without the tool
  Vec3Of<T> cog_F = Vec3Of<T>::Zero();  ///< centre of gravity in F [m]
  int tool = 0;                         ///< index of the tool, see CellModel::ToolAt
  int item = 0;                         ///< number of the payload item in `mass_kg`; 0: none
};

using Payload = PayloadOf<double>;

/// A mass and its first moment about the origin of B, expressed in B.
template <typename T>
struct MassOf {
  T kg = T(0);
  Vec3Of<T> kg_m = Vec3Of<T>::Zero();
};

/// Entry k: everything outboard of joint k, including its own link. Entry n: tool and payload.
template <typename T>
using OutboardMassesOf = std::array<MassOf<T>, model::kMaxJoints + 1>;

/// Largest plausible payload [kg]; larger values in files, registers and commands are rejected.
inline constexpr double kMaxPayload_kg = 5000;

/// The masses of a cell, each at a fixed point of its link frame.
///   tau_i = axis_i . sum_k (r_k - o_i) x (m_k g)   (revolute, [N m])
///   f_i   = axis_i . sum_k m_k g                    (prismatic, [N])
/// summed over links i..n at their centres of mass, the tool body and mount, and the payload at its
/// centre of gravity, all on the undeflected tool. Positive in the direction of positive q_i.
/// A drive that also turns another axis (model::CouplingDrive::kReading) carries that axis' load
/// times the ratio: tau = E^T (tau_i), by virtual work.
class GravityLoads {
 public:
  /// If a link has no declared centre of mass, the midpoint of its DH offset is used (see
  /// guessed()).
  explicit GravityLoads(const model::CellModel& cell);

  /// True if every link from that joint (0..n-1) outwards has a declared mass, so that tau_i is
  /// known.
  bool known(int joint) const { return joint >= known_from_; }
  /// True if a link with mass, from that joint outwards, has no declared centre of mass.
  bool guessed(int joint) const { return joint < guessed_before_; }
  /// Mass of tool body and mount [kg].
  double tool_mass_kg(int tool = 0) const { return Tool(tool).mass_kg; }
  /// A link as a point mass.
  struct LinkMass {
    double mass_kg;  ///< 0 if not declared
    Vec3 com_L;      ///< centre of mass in the link's DH frame [m]
  };
  const std::vector<LinkMass>& links() const { return links_; }
  /// First moment of the tool body, without the mount, about the origin of F [kg m].
  const Vec3& tool_body_kg_m(int tool = 0) const { return Tool(tool).body_kg_m; }

  /// Computes the torques in one posture. Does not allocate.
  /// @param g_B       gravity in B [m/s^2]
  /// @param tau       out: torques [N m] or forces [N], shape (n)
  /// @param outboard  out: the masses outboard of each joint; may be null
  /// @return          moment of the whole weight about the origin of B, in B [N m]
  template <typename T>
  Vec3Of<T> Torques(const kinematics::PostureOf<T>& posture, const Vec3Of<T>& g_B,
                    const PayloadOf<T>& payload, model::JointVectorOf<T>& tau,
                    OutboardMassesOf<T>* outboard = nullptr) const;

 private:
  std::vector<LinkMass> links_;
  std::vector<model::JointType> types_;
  std::vector<model::JointCoupling> couplings_;
  struct ToolMass {
    double mass_kg = 0;             ///< body and mount
    Vec3 com_F = Vec3::Zero();      ///< of both [m]
    Vec3 body_kg_m = Vec3::Zero();  ///< first moment of the body
  };
  static ToolMass MassOf(const model::Tool& tool);
  const ToolMass& Tool(int tool) const { return tools_[tool]; }
  std::vector<ToolMass> tools_;
  int known_from_ = 0;
  int guessed_before_ = 0;
};

template <typename T>
Vec3Of<T> GravityLoads::Torques(const kinematics::PostureOf<T>& posture, const Vec3Of<T>& g_B,
                                const PayloadOf<T>& payload, model::JointVectorOf<T>& tau,
                                OutboardMassesOf<T>* outboard) const {
  tau.resize(posture.size);
  // Mass and first moment of everything outboard of the joint suffice, because gravity is uniform.
  const PoseOf<T>& X_BF = posture.X_BF();
  const ToolMass& tool = Tool(payload.tool);
  const Vec3Of<T> tool_com_F = tool.com_F.cast<T>();
  T mass_kg = tool.mass_kg + payload.mass_kg;
  Vec3Of<T> moment_kg_m =
      tool.mass_kg * (X_BF * tool_com_F) + payload.mass_kg * (X_BF * payload.cog_F);
  if (outboard != nullptr) {
    (*outboard)[posture.size] = {mass_kg, moment_kg_m};
  }
  for (int i = posture.size - 1; i >= 0; --i) {
    const auto k = static_cast<std::size_t>(i);
    const Vec3Of<T> com_L = links_[k].com_L.template cast<T>();
    mass_kg += links_[k].mass_kg;
    moment_kg_m += links_[k].mass_kg * (posture.X_BL[k] * com_L);
    if (outboard != nullptr) (*outboard)[k] = {mass_kg, moment_kg_m};
    if (types_[k] == model::JointType::kRevolute) {
      const Vec3Of<T> arm_kg_m = moment_kg_m - mass_kg * posture.point_B[k];
      tau[i] = posture.axis_B[k].dot(arm_kg_m.cross(g_B));
    } else {
      tau[i] = mass_kg * posture.axis_B[k].dot(g_B);
    }
  }
  if (!couplings_.empty()) tau = model::DriveTorques<T>(couplings_, tau);
  return moment_kg_m.cross(g_B);
}

}  // namespace plumbline::loads
