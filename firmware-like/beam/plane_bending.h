// Bending of straight elements in one plane: the finite element, and what is inside it.
//
// s runs along the element from its inboard end (towards the root), u is the transverse
// displacement, theta the rotation of the section that goes with it. On a face that looks outboard
// act the shear force V along u and the moment M:
//   V' = -w,  M' = -V,  EI theta' = M,  u' = theta + V / (kappa G A)
#pragma once

#include <Eigen/Core>
#include <vector>

namespace plumbline {

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

/// What loads one element: w(s) = w0 + w1 s, and points.
struct PlaneLoad {
  double w0_N_m = 0;
  double w1_N_m2 = 0;
  std::vector<PlanePointLoad> points = {};
};

/// A section: how it stands and what it carries.
struct PlaneState {
  double u_m = 0;
  double theta_rad = 0;
  double shear_N = 0;
  double moment_Nm = 0;
};

/// The system of equations is built and solved in extended precision: rounding grows with the
/// fourth power of the number of elements.
using BeamReal = long double;
using BeamMatrix4 = Eigen::Matrix<BeamReal, 4, 4>;
using BeamVector2 = Eigen::Matrix<BeamReal, 2, 1>;

/// Stiffness of [u1, theta1, u2, theta2] for a Timoshenko element, with phi = 12 EI/(kappa G A
/// l^2):
///   EI / (l^3 (1 + phi)) [K]         [Przemieniecki, Theory of Matrix Structural Analysis, 5.6]
/// phi = 0 is the Euler-Bernoulli element, {F} = EI/l^3 [K] {d}, eq. 1 of the paper.
BeamMatrix4 StiffnessMatrix(const PlaneElement& element);

/// Nodal loads equivalent to what acts between the nodes: the fixed-end reactions, negated. They
/// are the consistent ones, so that node values do not depend on the number of elements.
Eigen::Vector4d NodalLoads(const PlaneElement& element, const PlaneLoad& load);

/// The section at s, from that at s = 0, by integration of the equations above: exact for the
/// loads that the element carries. At a point load: just inboard of it.
PlaneState StateAt(const PlaneElement& element, const PlaneLoad& load, const PlaneState& start,
                   double s_m);

/// A row of elements clamped at the inboard end of the first.
/// @param loads       one an element
/// @param node_loads  force and moment at each node, the root's first, which the clamp takes
/// @return            the inboard end of each element
std::vector<PlaneState> SolveCantilever(const std::vector<PlaneElement>& elements,
                                        const std::vector<PlaneLoad>& loads,
                                        const std::vector<Eigen::Vector2d>& node_loads);

}  // namespace plumbline
