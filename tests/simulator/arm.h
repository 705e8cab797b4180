// Forward model of the loaded arm: the declared model of the exchange format plus hidden effects.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "tests/simulator/cell.h"
#include "tests/simulator/effect.h"

namespace simulator {

/// One row of a pose table in SI units. Values that were not recorded are zero and flagged in
/// Table.
struct Row {
  std::string session;
  double t_s = 0.0;
  Eigen::VectorXd q_rad, qd_rad_s, qdd_rad_s2, tau_Nm, last_move_rad;
  double payload_kg = 0.0;
  double temp_C = 0.0;
  double pressure_bar = 1.0;
  Eigen::Vector2d tilt_rad = Eigen::Vector2d::Zero();  ///< inclinometer reading on the base
  Eigen::Vector3d xyz_m = Eigen::Vector3d::Zero();
  double range_m = 0.0;  ///< from the cell's anchor, or from the artefact; replaces xyz_m
  std::string artefact;  ///< that is touched or measured against; empty: none
  double gauge_m = 0.0;  ///< reading of a dial gauge
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  ///< orientation of the tip (columns)
};

/// A square-tube cantilever with a payload: tip displacement in the flange frame [m].
///   d_x = F_x L^3/(3EI) + M_y L^2/(2EI) + w_x L^4/(8EI),  d_y alike with -M_x,  d_z = 0
///   F = m g,  M = (cog - (0,0,L)) x F,  w = density area g
Eigen::Vector3d Bending(const Tool& tool, const Eigen::Vector3d& g_F, double payload_kg,
                        const Eigen::Vector3d& cog_m);

/// Slope of the end of that cantilever: rotation vector in the flange frame [rad].
///   r_y = F_x L^2/(2EI) + M_y L/(EI) + w_x L^3/(6EI),  r_x alike with -F_y, M_x and -w_y,  r_z = 0
Eigen::Vector3d Slope(const Tool& tool, const Eigen::Vector3d& g_F, double payload_kg,
                      const Eigen::Vector3d& cog_m);

struct Walker;

/// The deflected arm at one row. Torques are computed from the composite outboard mass and its
/// centre, accumulated from the tip inwards; the posture is iterated until no joint changes by
/// 1e-14 rad.
class Arm {
 public:
  Arm(const Cell& cell, const Changes& changes) : cell_(cell), changes_(changes) {}

  /// Tip position reported by a noiseless instrument [m], in the measurement frame.
  Eigen::Vector3d Tip(const Row& row) const;

  /// Orientation of the tip in the measurement frame (columns: its axes).
  Eigen::Matrix3d TipAxes(const Row& row) const;

  /// Reported distance of a tip from the cell's anchor [m].
  double Range(const Eigen::Vector3d& tip_m) const;

  /// Gravity torques about the joints in the deflected posture, in their positive direction [N m].
  Eigen::VectorXd Torques(const Row& row) const;

  /// The flange of the deflected arm: origin and axes (columns) in the measurement frame.
  struct Flange {
    Eigen::Vector3d origin_m;
    Eigen::Matrix3d axes;
  };
  Flange FlangeAt(const Row& row) const;

  /// Sum of m_k g . r_k over links, tool, mount and payload with the joint deflections fixed at s
  /// [J]; its derivative with respect to q_i is the torque about joint i.
  double WorkOfGravity(const Row& row, const Eigen::VectorXd& s_rad) const;

 private:
  struct Posture;
  struct Yields;
  Posture Solve(const Row& row) const;
  void Place(const Row& row, const Eigen::VectorXd& s_rad, const Eigen::Vector3d& tilt_rad,
             Posture& posture, const std::vector<Yields>* yields = nullptr) const;
  Walker Yielded(const Row& row, const Posture& solved) const;
  std::vector<Yields> YieldsOf(const Row& row, const Posture& posture) const;
  double BendingFactor(const Row& row) const;  ///< of the tool, by creep and payload
  Eigen::VectorXd UnweighedSag(const Row& row) const;
  Eigen::VectorXd Deflection(const Row& row, const Eigen::VectorXd& torque_Nm) const;
  Eigen::Vector3d Gravity() const;
  double Payload(const Row& row) const;
  Eigen::Vector3d Seen(const Row& row, const Eigen::Vector3d& p) const;

  const Cell& cell_;
  const Changes& changes_;
};

/// Noiseless readings of all rows [mm]: x, y, z of each, or its range if the cell
/// has an anchor.
Eigen::VectorXd Readings(const Cell& cell, const Effects& effects, const std::vector<Row>& rows);

/// Tips of all rows.
std::vector<Eigen::Vector3d> Tips(const Cell& cell, const Effects& effects,
                                  const std::vector<Row>& rows);

/// Orientations of the tips of all rows.
std::vector<Eigen::Matrix3d> TipsAxes(const Cell& cell, const Effects& effects,
                                      const std::vector<Row>& rows);

}  // namespace simulator
