// Where the tip of a loaded arm is: the model that the exchange format declares, with the effects
// that a data set hides.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "tests/simulator/cell.h"
#include "tests/simulator/effect.h"

namespace simulator {

/// One row of a table of poses, in SI. What was not recorded is zero and marked in Table.
struct Row {
  std::string session;
  double t_s = 0.0;
  Eigen::VectorXd q_rad, qd_rad_s, qdd_rad_s2, tau_Nm, last_move_rad;
  double payload_kg = 0.0;
  double temp_C = 0.0;
  double pressure_bar = 1.0;
  Eigen::Vector2d tilt_rad = Eigen::Vector2d::Zero();  ///< of the base, as its inclinometer reads
  Eigen::Vector3d xyz_m = Eigen::Vector3d::Zero();
  double range_m = 0.0;  ///< from the cell's anchor, in place of xyz_m
};

/// A square-tube cantilever with a payload: tip displacement in the flange frame [m].
///   d_x = F_x L^3/(3EI) + M_y L^2/(2EI) + w_x L^4/(8EI),  d_y alike with -M_x,  d_z = 0
///   F = m g,  M = (cog - (0,0,L)) x F,  w = density area g
Eigen::Vector3d Bending(const Tool& tool, const Eigen::Vector3d& g_F, double payload_kg,
                        const Eigen::Vector3d& cog_m);

struct Walker;

/// The sagged arm at one row. Torques come from the outboard composite mass and its centre,
/// gathered from the tip inwards; the posture is iterated until no joint moves by 1e-14 rad.
class Arm {
 public:
  Arm(const Cell& cell, const Changes& changes) : cell_(cell), changes_(changes) {}

  /// Tip as the instrument reads it, without noise [m], in the measurement frame.
  Eigen::Vector3d Tip(const Row& row) const;

  /// Distance of a tip from the cell's anchor, as it is read [m].
  double Range(const Eigen::Vector3d& tip_m) const;

  /// Gravity torques about the joints, in their positive direction [N m], in the sagged posture.
  Eigen::VectorXd Torques(const Row& row) const;

  /// The sagged flange: origin and axes (columns) in the measurement frame.
  struct Flange {
    Eigen::Vector3d origin_m;
    Eigen::Matrix3d axes;
  };
  Flange FlangeAt(const Row& row) const;

  /// sum of m_k g . r_k over links, tool, mount and payload with the joints held at s [J]; its
  /// derivative by q_i is the torque about joint i.
  double WorkOfGravity(const Row& row, const Eigen::VectorXd& s_rad) const;

 private:
  struct Posture;
  struct Yields;
  Posture Solve(const Row& row) const;
  void Place(const Row& row, const Eigen::VectorXd& s_rad, const Eigen::Vector3d& tilt_rad,
             Posture& posture, const std::vector<Yields>* yields = nullptr) const;
  Walker Yielded(const Row& row, const Posture& solved) const;
  std::vector<Yields> YieldsOf(const Row& row, const Posture& posture) const;
  Eigen::VectorXd UnweighedSag(const Row& row) const;
  Eigen::VectorXd Deflection(const Row& row, const Eigen::VectorXd& torque_Nm) const;
  Eigen::Vector3d Gravity() const;
  double Payload(const Row& row) const;
  Eigen::Vector3d Seen(const Row& row, const Eigen::Vector3d& p) const;

  const Cell& cell_;
  const Changes& changes_;
};

/// What a noiseless instrument reads at all rows [mm]: x, y, z of each, or its range where the cell
/// has an anchor.
Eigen::VectorXd Readings(const Cell& cell, const Effects& effects, const std::vector<Row>& rows);

/// Tips of all rows.
std::vector<Eigen::Vector3d> Tips(const Cell& cell, const Effects& effects,
                                  const std::vector<Row>& rows);

}  // namespace simulator
