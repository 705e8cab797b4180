// D-optimal selection of rows.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace plumbline::measure {

/// Information matrix of a selection: identity (the prior) plus sum X_i^T X_i.
Eigen::MatrixXd Information(const std::vector<Eigen::MatrixXd>& rows,
                            const std::vector<int>& selected);

/// Indices of `count` different rows that maximise log det of their information: greedy, then
/// exchanges of single rows until no exchange gains, at most `passes` times through the selection.
/// @param rows  X_i, shape (numbers measured by row i, parameters); 0 <= count <= rows.size()
std::vector<int> DOptimalRows(const std::vector<Eigen::MatrixXd>& rows, int count, int passes);

/// log det of a positive definite matrix.
double LogDeterminant(const Eigen::MatrixXd& matrix);

}  // namespace plumbline::measure
