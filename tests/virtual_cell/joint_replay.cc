#include "tests/virtual_cell/joint_replay.h"

#include <fmt/core.h>

#include <algorithm>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace virtual_cell {
namespace {

std::vector<std::string> Cells(std::string line) {
  if (!line.empty() && line.back() == '\r') line.pop_back();
  std::vector<std::string> cells;
  std::istringstream text(line);
  for (std::string cell; std::getline(text, cell, ',');) cells.push_back(cell);
  return cells;
}

}  // namespace

std::vector<ReplayRow> ReadJointRows(const std::string& path, int joints) {
  std::ifstream file(path);
  std::string line;
  if (!std::getline(file, line)) throw std::runtime_error(path + ": cannot be read or is empty");
  const std::vector<std::string> header = Cells(line);
  const auto column = [&header](const std::string& name) {
    return static_cast<std::size_t>(std::find(header.begin(), header.end(), name) - header.begin());
  };
  std::vector<std::size_t> joint_columns;
  for (int i = 1; i <= joints; ++i) {
    joint_columns.push_back(column(fmt::format("q{}_deg", i)));
    if (joint_columns.back() == header.size()) {
      throw std::runtime_error(
          fmt::format("{}:1 has no column q{}_deg, the cell has {} joints", path, i, joints));
    }
  }
  std::vector<ReplayRow> rows;
  for (int number = 2; std::getline(file, line); ++number) {
    const std::vector<std::string> cells = Cells(line);
    const auto value = [&](std::size_t at) -> std::optional<double> {
      if (at >= header.size()) return std::nullopt;
      try {
        return std::stod(cells.at(at));
      } catch (const std::exception&) {
        throw std::runtime_error(
            fmt::format("{}:{} column {} is no number", path, number, header[at]));
      }
    };
    ReplayRow row;
    row.q.resize(joints);
    for (int i = 0; i < joints; ++i) {
      row.q[i] = RadFromDeg(*value(joint_columns[static_cast<std::size_t>(i)]));
    }
    row.payload_kg = value(column("payload_kg"));
    row.temperature_C = value(column("temp_C"));
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace virtual_cell
