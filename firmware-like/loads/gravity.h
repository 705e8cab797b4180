// Gravity torques about the joints from links, tool and payload.
#pragma once

#include <optional>
#include <vector>

#include "firmware-like/kinematics/chain.h"

namespace plumbline {

/// What the flange carries beyond the tool.
struct Payload {
  double mass_kg = 0;
  Vec3 cog_F = Vec3::Zero();  ///< centre of gravity in F [m]
};

/// The masses of a cell, each at a point of the frame it moves with.
///   tau_i = axis_i . sum_k (r_k - o_i) x (m_k g)   (revolute, [N m])
///   f_i   = axis_i . sum_k m_k g                    (prismatic, [N])
/// over the links i..n at their centres of mass, the tool at mid length and the payload at its
/// centre of gravity, all on the straight tool. Positive along the joint's own count.
class GravityLoads {
 public:
  /// A link without a centre of mass is taken half way along its DH offset (see guessed()).
  explicit GravityLoads(const CellModel& cell);

  /// False where a link has no declared mass: torques of the joints before it are unknown.
  bool known() const { return known_; }
  /// True where a centre of mass is a guess.
  bool guessed() const { return guessed_; }
  /// Tool body and mount [kg].
  double tool_mass_kg() const { return tool_mass_kg_; }

  /// Torques in one posture, shape (n). g_B in B [m/s^2]. Allocates nothing.
  void Torques(const Posture& posture, const Vec3& g_B, const Payload& payload,
               JointVector& tau) const;

 private:
  struct LinkMass {
    double mass_kg;
    Vec3 com_L;
  };
  std::vector<LinkMass> links_;
  std::vector<JointType> types_;
  double tool_mass_kg_ = 0;
  Vec3 tool_com_F_ = Vec3::Zero();
  bool known_ = true;
  bool guessed_ = false;
};

}  // namespace plumbline
