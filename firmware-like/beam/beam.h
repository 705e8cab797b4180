// The tool as a cantilever of finite elements.
//
// The beam lies along +z of the flange F, clamped at z = 0, and bends in both planes. Nodes are
// counted from the root, node 0. Rotations are those of F: with the rotation vector r of a section,
// a thin beam has d_x' = r_y and d_y' = -r_x. It does not stretch or twist (d_z = r_z = 0), as the
// declared model of cell.toml has it; axial forces and torques are carried without effect.
// Second moment of bending along x: iy_m4, along y: ix_m4.
#pragma once

#include <array>
#include <vector>

#include "firmware-like/beam/plane_bending.h"
#include "firmware-like/model/cell_model.h"

namespace plumbline {

/// A force [N] and a moment [N m] on the section at z, in F.
struct PointLoad {
  double z_m = 0;
  Vec3 force_F = Vec3::Zero();
  Vec3 moment_F = Vec3::Zero();
};

/// A mass held by the section at z with its centre of gravity elsewhere, as a payload is; its
/// rotary inertia is neglected.
struct PointMass {
  double mass_kg = 0;
  double z_m = 0;
  Vec3 cog_F = Vec3::Zero();
};

/// All that acts on the beam. A mass element at p carries, by d'Alembert's principle,
///   dF = dm (g - a - alpha x p),
/// so that an angular acceleration makes a load that grows along z. The centrifugal term
/// omega x (omega x p) is not included.
struct BeamLoads {
  std::vector<PointLoad> points = {};
  std::vector<PointMass> masses = {};
  Vec3 g_F = Vec3::Zero();                     ///< gravity [m/s^2]; zero: no own weight
  Vec3 acceleration_F = Vec3::Zero();          ///< of the flange [m/s^2]
  Vec3 angular_acceleration_F = Vec3::Zero();  ///< of the flange [rad/s^2]
};

/// One section: how it stands, and what its outboard part does to it.
struct SectionState {
  double z_m = 0;
  Vec3 d_F = Vec3::Zero();       ///< displacement [m]
  Vec3 r_F = Vec3::Zero();       ///< rotation vector [rad]
  Vec3 force_F = Vec3::Zero();   ///< shear force [N]
  Vec3 moment_F = Vec3::Zero();  ///< bending moment [N m]
};

/// A solved beam under one set of loads.
class BeamSolution {
 public:
  const std::vector<ToolSegment>& elements() const { return elements_; }
  int node_count() const { return static_cast<int>(elements_.size()) + 1; }
  double NodeZ(int node) const { return node_z_[static_cast<std::size_t>(node)]; }

  /// The section at a node; forces are those just inboard of it (at the root, just outboard).
  SectionState Node(int node) const;
  SectionState Tip() const { return Node(node_count() - 1); }

  /// The section at any z in 0..length, exact between nodes too; at a load: just inboard of it.
  SectionState At(double z_m) const;

  /// The section at s in 0..length of one element, its own side of the nodes.
  SectionState InElement(int element, double s_m) const;

  /// The element in which z lies; a node belongs to the element inboard of it.
  int ElementAt(double z_m) const;

  /// Loads within an element, in the planes x-z and y-z.
  const PlaneLoad& LoadIn(int element, int plane) const {
    return planes_[static_cast<std::size_t>(plane)].loads[static_cast<std::size_t>(element)];
  }

 private:
  friend class Beam;
  struct Plane {
    std::vector<PlaneElement> elements;
    std::vector<PlaneLoad> loads;
    std::vector<Eigen::Vector2d> node_loads;
    std::vector<PlaneState> ends;
  };

  std::vector<ToolSegment> elements_;
  std::vector<double> node_z_;
  std::array<Plane, 2> planes_;  ///< x-z (u = d_x, theta = r_y), y-z (u = d_y, theta = -r_x)
};

/// The elements of a tool. Values are validated ones: lengths, E, A and I are positive, which is
/// asserted; small displacements (|d|/L < 0.05) and linear elasticity are the model.
class Beam {
 public:
  /// @param tool  not rigid, with at least one segment
  Beam(const Tool& tool, int elements_per_segment);
  /// @param elements_of_segment  one positive count for each of the tool's segments
  Beam(const Tool& tool, const std::vector<int>& elements_of_segment);

  double Length() const { return unloaded_.node_z_.back(); }

  /// @param loads  with every z in 0..length (asserted)
  BeamSolution Solve(const BeamLoads& loads) const;

 private:
  static void AddField(BeamSolution& solution, const BeamLoads& loads);
  static void AddPoint(BeamSolution& solution, const PointLoad& load);

  BeamSolution unloaded_;
};

}  // namespace plumbline
