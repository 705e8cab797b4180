// Empirical term: a piecewise linear correction along one or two recorded signals, without a
// physical model.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

/// Adds value_k n_k(driver) to carrier k, with n piecewise linear between nodes and constant beyond
/// the first and last node. There is one parameter per carrier, named after it:
///   base_x, base_y, base_z    the base in W            nodes in mm
///   tip_x, tip_y, tip_z       the tip in F             nodes in mm
///   q1, q2, ..                deflection of the joint  nodes in rad
///   tool_bending              factor 1 + value on the bending of the tool, nodes in 1
///   a1, d1, a2, ..            length and offset of a link in the DH table  nodes in mm
///   tilt_x, tilt_y            rotation of the base about axes of W  nodes in rad
/// The value is a factor on the whole curve, usually 1 (or the shrinkage), and carries the standard
/// deviation. EffectTerm::nodes has one row per node: the driver's value, ascending, in the unit of
/// its column, followed by one value per parameter in their order. With two drivers the nodes form
/// a full grid with bilinear interpolation: the values of the first and the second driver, then the
/// parameters. Rows are grouped by the first value; within a group the second value ascends, and
/// every group has the same second values. EffectTerm::drivers names the columns; nothing is added
/// if one of them is unknown. Valid within the range of the nodes.
const Effect& Empirical();

/// Conversion factor from node units to SI units: 1e-3 for translations in mm, 1 for rotations and
/// ratios.
double EmpiricalNodeToSI(const TermParameter& parameter);

/// Error message if drivers and nodes do not form a valid empirical term with that many parameters;
/// empty if they do.
std::string EmpiricalFault(const std::vector<std::string>& drivers, const Eigen::MatrixXd& nodes,
                           std::size_t parameters);

}  // namespace plumbline::effects
