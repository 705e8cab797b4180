// The physical world: where a loaded, yielding arm really is when its controller says q.
//
// Equilibrium in the sagged posture: each joint turns by
//   s_i = c_i tau_i(q + s) + effects,
// tau from the wrenches of links, mount and rod; the rod is solved for gravity as the sagged
// flange sees it, and its root wrench is what it hands back to the joints.
#pragma once

#include "tests/virtual_cell/arm.h"
#include "tests/virtual_cell/effects.h"
#include "tests/virtual_cell/rod.h"

namespace virtual_cell {

/// What acts on the world at one moment.
struct Circumstances {
  Joints q = {};          ///< the controller's joint angles [rad], [m]
  Joints last_move = {};  ///< last move of each joint [rad]; empty: none known
  double payload_kg = 0;
  double temperature_C = 22;
  double time_s = 0;
};

/// What a laser tracker and torque sensors would see.
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

  Truth Settle(const Circumstances& now) const;
  const CellDescription& cell() const { return cell_; }

 private:
  Vec3 Gravity() const;
  double TipMass(double payload_kg) const;
  RodShape Tool(const Circumstances& now, const Vec3& g_F, const Vec3& guess) const;
  std::vector<Load> Loads(const Posture& posture, const Vec3& g_B, const RodShape& tool,
                          const Motion& X_BF) const;
  Joints Deflection(const Circumstances& now, const Joints& torque) const;
  Motion Base(const Circumstances& now) const;

  CellDescription cell_;
  Effects effects_;
};

/// The energy [J] stored in gravity and springs when the joints stand at q + s with a rigid
/// straight tool: an independent road to the torques, tau = -dV/ds of its gravity part.
double GravityEnergyStraightTool(const CellDescription& cell, const Joints& q, double payload_kg);

}  // namespace virtual_cell
