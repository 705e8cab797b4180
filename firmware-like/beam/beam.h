// Finite-element model of the tool as a cantilever beam.
//
// The beam lies along +z of the flange frame F, is clamped at z = 0 and bends in both planes. Nodes
// are numbered from the root, node 0. Rotations are expressed in F: with the rotation vector r of a
// section, a slender beam has d_x' = r_y and d_y' = -r_x. The beam does not stretch or twist
// (d_z = r_z = 0), as the declared model of cell.toml defines; axial forces and torques have no
// effect. Bending along x is governed by iy_m4, bending along y by ix_m4.
#pragma once

#include <array>
#include <vector>

#include "firmware-like/beam/plane_bending.h"
#include "firmware-like/model/cell_model.h"

namespace plumbline::beam {

/// A force [N] and a moment [N m] acting on the section at z, in F.
struct PointLoad {
  double z_m = 0;
  Vec3 force_F = Vec3::Zero();
  Vec3 moment_F = Vec3::Zero();
};

/// A mass attached to the section at z, with an offset centre of gravity, such as a payload. Its
/// rotary inertia is neglected.
struct PointMass {
  double mass_kg = 0;
  double z_m = 0;
  Vec3 cog_F = Vec3::Zero();
};

/// Loads on the beam. By d'Alembert's principle, a mass element at p is loaded by
///   dF = dm (g - a - alpha x p),
/// so an angular acceleration produces a load that grows along z. The centrifugal term
/// omega x (omega x p) is neglected.
struct BeamLoads {
  std::vector<PointLoad> points = {};
  std::vector<PointMass> masses = {};
  Vec3 g_F = Vec3::Zero();                     ///< gravity [m/s^2]; zero: no self-weight
  Vec3 acceleration_F = Vec3::Zero();          ///< of the flange [m/s^2]
  Vec3 angular_acceleration_F = Vec3::Zero();  ///< of the flange [rad/s^2]
};

/// State of one section: its displacement and rotation, and the internal forces exerted by the part
/// outboard of it.
struct SectionState {
  double z_m = 0;
  Vec3 d_F = Vec3::Zero();       ///< displacement [m]
  Vec3 r_F = Vec3::Zero();       ///< rotation vector [rad]
  Vec3 force_F = Vec3::Zero();   ///< shear force [N]
  Vec3 moment_F = Vec3::Zero();  ///< bending moment [N m]
};

/// Solution of a beam under one set of loads.
class BeamSolution {
 public:
  const std::vector<model::ToolSegment>& elements() const { return elements_; }
  int node_count() const { return static_cast<int>(elements_.size()) + 1; }
  double NodeZ(int node) const { return node_z_[node]; }

  /// Section at a node. Internal forces are those just inboard of the node (at the root: outboard).
  SectionState Node(int node) const;
  SectionState Tip() const { return Node(node_count() - 1); }

  /// Section at any z in 0..length, exact between nodes too. At a point load: just inboard of it.
  SectionState At(double z_m) const;

  /// Section at s in 0..length of one element. At a node: on the side of this element.
  SectionState InElement(int element, double s_m) const;

  /// Index of the element that contains z; a node belongs to the element inboard of it.
  int ElementAt(double z_m) const;

  /// Loads within an element. @param plane  0: x-z, 1: y-z
  const PlaneLoad& LoadIn(int element, int plane) const { return planes_[plane].loads[element]; }

 private:
  friend class Beam;
  struct Plane {
    std::vector<PlaneElement> elements;
    std::vector<PlaneLoad> loads;
    std::vector<Eigen::Vector2d> node_loads;
    std::vector<PlaneState> ends;
  };

  std::vector<model::ToolSegment> elements_;
  std::vector<double> node_z_;
  std::array<Plane, 2> planes_;  ///< x-z (u = d_x, theta = r_y), y-z (u = d_y, theta = -r_x)
};

/// Finite-element beam of a tool. Lengths, E, A and I must be positive (asserted). Valid for small
/// displacements (|d|/L < 0.05) and linear elasticity.
class Beam {
 public:
  /// @param tool  not rigid, with at least one segment
  Beam(const model::Tool& tool, int elements_per_segment);
  /// @param elements_of_segment  one positive count for each segment of the tool
  Beam(const model::Tool& tool, const std::vector<int>& elements_of_segment);

  double Length() const { return unloaded_.node_z_.back(); }

  /// @param loads  every z must be in 0..length (asserted)
  BeamSolution Solve(const BeamLoads& loads) const;

 private:
  static void AddField(BeamSolution& solution, const BeamLoads& loads);
  static void AddPoint(BeamSolution& solution, const PointLoad& load);

  BeamSolution unloaded_;
};

}  // namespace plumbline::beam
