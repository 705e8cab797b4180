// A correction without a physical name: what the residual does along one or two recorded signals.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline {

/// Adds value_k n_k(driver) to carrier k, n piecewise linear between nodes and held constant beyond
/// the first and the last one. One parameter a carrier, named after it:
///   base_x, base_y, base_z    the base in W            nodes in mm
///   tip_x, tip_y, tip_z       the tip in F             nodes in mm
///   q1, q2, ..                turn of the joint        nodes in rad
///   tool_bending              the tool bends times 1 + value, nodes in 1
/// The value is a factor on the whole curve, usually 1 (or the shrinkage), and carries the
/// deviation. Term.nodes has one row a node: the driver's value, ascending, in the unit of its
/// column; then one column a parameter, in their order. With two drivers the nodes are a full grid,
/// bilinear between: the first driver's value, the second's, then the parameters; of rows with the
/// same first value the second rises, and every such group has the same second values. Term.drivers
/// names the columns; in a moment where one is not known nothing is added. Valid inside its nodes
/// only.
const Effect& Empirical();

/// SI units in one unit of a node of that carrier: 1e-3 of a shift, in mm; 1 of a turn or a ratio.
double EmpiricalNodeToSI(const TermParameter& parameter);

/// Why drivers and nodes make no empirical term of that many parameters; empty where they do.
std::string EmpiricalFault(const std::vector<std::string>& drivers, const Eigen::MatrixXd& nodes,
                           std::size_t parameters);

}  // namespace plumbline
