// Tables of poses and measured points, as the exchange format has them.
#pragma once

#include <string>
#include <vector>

#include "tests/simulator/arm.h"

namespace simulator {

/// The rows of a file and which columns it has.
struct Table {
  std::vector<Row> rows;
  bool session = false, t = false, qd = false, qdd = false, tau = false, payload = false,
       temp = false, pressure = false, tilt = false, xyz = false, range = false;
  std::vector<bool> prismatic;  ///< joints whose positions are in metres (mm in the file)
};

/// Reads a table and works out each joint's last move from the order of the rows: the difference
/// to the nearest earlier row of another angle, zero where there is none. Coordinates that were not
/// measured in a row are NaN.
/// @throws std::runtime_error with the line of a row that cannot be read
Table ReadTable(const std::string& path, const Cell& cell);

/// Writes 1e-5 degree and 1e-5 mm, so that every number is the one that was simulated with.
void WriteTable(const Table& table, const std::string& path);

void WritePoints(const std::vector<Eigen::Vector3d>& points_m, const std::string& path);

void FillLastMoves(std::vector<Row>& rows);

/// Rounds what WriteTable rounds: the simulation must see the angles of the file.
void RoundAsWritten(std::vector<Row>& rows);

}  // namespace simulator
