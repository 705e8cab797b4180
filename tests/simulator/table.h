// Tables of poses and measured points in the exchange format.
#pragma once

#include <string>
#include <vector>

#include "tests/simulator/arm.h"

namespace simulator {

/// Rows of a file, and flags for its columns.
struct Table {
  std::vector<Row> rows;
  bool session = false, t = false, qd = false, qdd = false, tau = false, payload = false,
       temp = false, pressure = false, tilt = false, xyz = false, range = false, artefact = false,
       gauge = false, axes = false;
  std::vector<bool> prismatic;  ///< joints whose positions are in metres (mm in the file)
};

/// Reads a table and derives each joint's last move from the order of the rows: the difference from
/// the nearest earlier row with another angle, zero if there is none. Coordinates that were not
/// measured in a row are NaN.
/// @throws std::runtime_error with the line of a row that cannot be read
Table ReadTable(const std::string& path, const Cell& cell);

/// Writes with a resolution of 1e-5 degree and 1e-5 mm, the values that were simulated.
void WriteTable(const Table& table, const std::string& path);

void WritePoints(const std::vector<Eigen::Vector3d>& points_m, const std::string& path);

void FillLastMoves(std::vector<Row>& rows);

/// Applies the rounding of WriteTable, so that the simulation uses the angles of the file.
void RoundAsWritten(std::vector<Row>& rows);

}  // namespace simulator
