// Finite-element model of the tool as a cantilever beam.
//
// The beam lies along +z of the flange frame F, is clamped at z = 0 and bends in both planes. Nodes
// are numbered from the root, node 0. Rotations are expressed in F: with the rotation vector r of a
// section, a slender beam has d_x' = r_y and d_y' = -r_x. The beam does not stretch or twist
// (d_z = r_z = 0), as the declared model of cell.toml defines; axial forces and torques have no
// effect. Bending along x is governed by iy_m4, bending along y by ix_m4.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "firmware-like/model/cell_model.h"

namespace plumbline::beam {

// Beam element for bending in one plane: stiffness, nodal loads and the exact interior solution.
//
// s runs along the element from its inboard end (nearer the root), u is the transverse
// displacement, theta the rotation of the section. The shear force V (along u) and the moment M act
// on a face whose normal points outboard:
//   V' = -w,  M' = -V,  EI theta' = M,  u' = theta + V / (kappa G A)

/// One element in one plane.
struct PlaneElement {
  double length_m = 0;
  double stiffness_Nm2 = 0;           ///< EI
  double shear_compliance_per_N = 0;  ///< 1 / (kappa G A); 0: Euler-Bernoulli
};

/// A force along u and a moment along theta at s, 0 < s < length.
struct PlanePointLoad {
  double s_m = 0;
  double force_N = 0;
  double moment_Nm = 0;
};

/// Loads on one element: a distributed load w(s) = w0 + w1 s and point loads.
struct PlaneLoad {
  double w0_N_m = 0;
  double w1_N_m2 = 0;
  std::vector<PlanePointLoad> points = {};
};

/// State of a section: displacement, rotation and internal forces.
struct PlaneState {
  double u_m = 0;
  double theta_rad = 0;
  double shear_N = 0;
  double moment_Nm = 0;
};

/// The system of equations is assembled and solved in extended precision, because rounding errors
/// grow with the fourth power of the number of elements.
using BeamReal = long double;
using BeamMatrix4 = Eigen::Matrix<BeamReal, 4, 4>;
using BeamVector2 = Eigen::Matrix<BeamReal, 2, 1>;

/// Stiffness matrix of a Timoshenko element for [u1, theta1, u2, theta2], with
/// phi = 12 EI / (kappa G A l^2):
///   EI / (l^3 (1 + phi)) [K]         [Przemieniecki, Theory of Matrix Structural Analysis, 5.6]
/// phi = 0 gives the Euler-Bernoulli element, {F} = EI/l^3 [K] {d}.
BeamMatrix4 StiffnessMatrix(const PlaneElement& element);

/// Consistent nodal loads equivalent to the loads between the nodes: the negated fixed-end
/// reactions. With them, node values do not depend on the number of elements.
Eigen::Vector4d NodalLoads(const PlaneElement& element, const PlaneLoad& load);

/// Section at s, integrated from the section at s = 0 by the equations above; exact for the loads
/// of the element. Where s is the position of a point load, the section is the one just inboard of
/// the load.
PlaneState StateAt(const PlaneElement& element, const PlaneLoad& load, const PlaneState& start,
                   double s_m);

/// Solves a row of elements that is clamped at the inboard end of the first one.
/// @param loads       one entry per element
/// @param node_loads  force [N] and moment [N m] at each node from the root outwards; the first
///                    entry acts on the clamp
/// @return            the section at the inboard end of each element
std::vector<PlaneState> SolveCantilever(const std::vector<PlaneElement>& elements,
                                        const std::vector<PlaneLoad>& loads,
                                        const std::vector<Eigen::Vector2d>& node_loads);

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

// Stress in the beam from bending moments and shear forces.

/// Stress in one section; magnitudes without sign.
struct SectionStress {
  double normal_Pa = 0;     ///< at the outermost fibre
  double shear_Pa = 0;      ///< at the neutral axis
  double von_mises_Pa = 0;  ///< upper bound: sqrt(normal^2 + 3 shear^2)
};

/// Stress of a section under a shear force and a bending moment.
///   normal = |My| reach_x / Iy + |Mx| reach_y / Ix   (at a corner; round: root of sum of squares)
///   shear  = hypot(Vx / peak_x, Vy / peak_y)         [Gere & Timoshenko, ch. 5]
/// Normal and shear stress peak at different fibres, so within beam theory the von Mises value is
/// an upper bound. Stress concentrations at notches, welds and the clamp are not included.
/// @return nullopt if the outermost fibre of the section is unknown
std::optional<SectionStress> StressOf(const model::Section& section, const SectionState& state);

/// The most loaded section of an element.
struct ElementStress {
  SectionState largest_moment;  ///< where |M| is largest
  SectionState largest_shear;   ///< where |V| is largest
  struct Peak {
    double z_m = 0;
    SectionStress stress;
  };
  std::optional<Peak> peak;  ///< where the von Mises stress is largest; nullopt if unknown
};

/// Largest moment, shear force and stress of one element, evaluated at both ends, on both sides of
/// each load, at zeros of the shear force, and at nine intermediate stations.
ElementStress StressInElement(const BeamSolution& solution, int element);

/// Largest stress of the beam and its location.
struct LargestStress {
  std::optional<ElementStress::Peak> peak;  ///< nullopt if unknown in every element
  int element = 0;                          ///< index of the element
  bool complete = true;  ///< false if the outermost fibre of a section is unknown
};
LargestStress LargestStressOf(const BeamSolution& solution);

}  // namespace plumbline::beam
