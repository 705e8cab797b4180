// Beam element for bending in one plane: stiffness, nodal loads and the exact interior solution.
//
// s runs along the element from its inboard end (nearer the root), u is the transverse
// displacement, theta the rotation of the section. The shear force V (along u) and the moment M act
// on a face whose normal points outboard:
//   V' = -w,  M' = -V,  EI theta' = M,  u' = theta + V / (kappa G A)
#pragma once

#include <Eigen/Core>
#include <vector>

namespace plumbline::beam {

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

}  // namespace plumbline::beam
