// Physical world: actual pose of the loaded, compliant arm for controller joints q.
//
// Equilibrium in the deflected posture: each joint deflects by
//   s_i = c_i tau_i(q + s) + effects,
// with tau from the wrenches of links, mount and rod. The rod is solved for gravity in the frame of
// the deflected flange, and its root wrench loads the joints.
#pragma once

#include "tests/virtual_cell/arm.h"
#include "tests/virtual_cell/effects.h"
#include "tests/virtual_cell/rod.h"

namespace virtual_cell {

/// Inputs of the world at one instant.
struct WorldInputs {
  Joints q = {};          ///< the controller's joint angles [rad], [m]
  Joints last_move = {};  ///< last move of each joint [rad]; empty: none known
  double payload_kg = 0;
  double temperature_C = 22;
  double time_s = 0;
};

/// True state, as ideal instruments would measure it.
struct Truth {
  Motion X_WT = Motion::Identity();  ///< tool tip
  Motion X_WF = Motion::Identity();  ///< flange
  Joints deflection;                 ///< s [rad]
  Joints torque;                     ///< tau [N m]
  bool converged = false;
};

class World {
 public:
  explicit World(CellDescription cell, Effects effects = {});

  Truth Settle(const WorldInputs& now) const;
  const CellDescription& cell() const { return cell_; }

 private:
  Vec3 Gravity() const;
  double TipMass(double payload_kg) const;
  RodShape Tool(const WorldInputs& now, const Vec3& g_F, const Vec3& guess) const;
  std::vector<Load> Loads(const Posture& posture, const Vec3& g_B, const RodShape& tool,
                          const Motion& X_BF) const;
  Joints Deflection(const WorldInputs& now, const Joints& torque) const;
  Motion Base(const WorldInputs& now) const;

  CellDescription cell_;
  Effects effects_;
};

/// Potential energy [J] of gravity and springs with the joints at q + s and a rigid
/// straight tool: an independent way to compute torques, tau = -dV/ds of its gravity part.
double GravityEnergyStraightTool(const CellDescription& cell, const Joints& q, double payload_kg);

}  // namespace virtual_cell
