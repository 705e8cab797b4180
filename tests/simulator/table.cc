#include "tests/simulator/table.h"

#include <fmt/core.h>

#include <Eigen/Geometry>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <map>
#include <sstream>
#include <stdexcept>

namespace simulator {
namespace {

std::vector<std::string> Split(const std::string& line) {
  std::vector<std::string> cells;
  std::istringstream stream(line);
  for (std::string cell; std::getline(stream, cell, ',');) {
    while (!cell.empty() && (cell.back() == '\r' || cell.back() == ' ')) cell.pop_back();
    cells.push_back(cell);
  }
  return cells;
}

double Rounded(double value, double step) {
  return std::round(value / step) * step;
}

}  // namespace

void FillLastMoves(std::vector<Row>& rows) {
  for (std::size_t k = 0; k < rows.size(); ++k) {
    rows[k].last_move_rad = Eigen::VectorXd::Zero(rows[k].q_rad.size());
    if (k == 0) continue;
    for (int i = 0; i < rows[k].q_rad.size(); ++i) {
      const double move = rows[k].q_rad[i] - rows[k - 1].q_rad[i];
      rows[k].last_move_rad[i] = move != 0.0 ? move : rows[k - 1].last_move_rad[i];
    }
  }
}

void RoundAsWritten(std::vector<Row>& rows) {
  for (Row& row : rows) {
    for (Eigen::VectorXd* angles : {&row.q_rad, &row.qd_rad_s, &row.qdd_rad_s2}) {
      for (double& angle : *angles) angle = Rounded(angle / kDeg, 1e-5) * kDeg;
    }
    row.t_s = Rounded(row.t_s, 1e-5);
    row.temp_C = Rounded(row.temp_C, 1e-5);
    row.pressure_bar = Rounded(row.pressure_bar, 1e-5);
    for (double& tilt : row.tilt_rad) tilt = Rounded(tilt / kDeg, 1e-5) * kDeg;
  }
}

Table ReadTable(const std::string& path, const Cell& cell) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error("cannot read " + path);
  std::string line;
  std::getline(file, line);
  std::map<std::string, std::size_t> column;
  for (const std::string& name : Split(line)) column.emplace(name, column.size());
  const auto has = [&](const std::string& name) { return column.contains(name); };
  Table table;
  table.session = has("session");
  table.t = has("t_s");
  table.qd = has("qd1_deg_s");
  table.qdd = has("qdd1_deg_s2");
  table.tau = has("tau1_Nm");
  table.payload = has("payload_kg");
  table.temp = has("temp_C");
  table.pressure = has("air_pressure_bar");
  table.tilt = has("tilt_x_deg");
  table.xyz = has("x_mm");
  table.range = has("range_mm");
  for (const Joint& joint : cell.joints) table.prismatic.push_back(joint.prismatic);
  const int n = int(cell.joints.size());
  for (int number = 2; std::getline(file, line); ++number) {
    const std::vector<std::string> cells = Split(line);
    if (cells.empty()) continue;
    const auto value = [&](const std::string& name, double otherwise) {
      const auto found = column.find(name);
      if (found == column.end()) return otherwise;
      // Not measured in this row; a short line lacks its last cells.
      const bool measured =
          name == "range_mm" || name == "x_mm" || name == "y_mm" || name == "z_mm";
      if (measured && (found->second >= cells.size() || cells[found->second].empty())) {
        return std::numeric_limits<double>::quiet_NaN();
      }
      try {
        return std::stod(cells.at(found->second));
      } catch (const std::exception&) {
        throw std::runtime_error(fmt::format("{}:{}: {} cannot be read", path, number, name));
      }
    };
    Row row;
    if (table.session) row.session = cells.at(column["session"]);
    row.t_s = value("t_s", 0.0);
    row.payload_kg = value("payload_kg", 0.0);
    row.temp_C = value("temp_C", cell.reference_temperature_C);
    row.pressure_bar = value("air_pressure_bar", 1.0);
    row.tilt_rad = Eigen::Vector2d(value("tilt_x_deg", 0.0), value("tilt_y_deg", 0.0)) * kDeg;
    row.q_rad.setZero(n);
    row.qd_rad_s.setZero(n);
    row.qdd_rad_s2.setZero(n);
    if (table.tau) row.tau_Nm.setZero(n);
    for (int i = 0; i < n; ++i) {
      row.q_rad[i] = cell.joints[std::size_t(i)].prismatic
                         ? value(fmt::format("q{}_mm", i + 1), 0.0) * 1e-3
                         : value(fmt::format("q{}_deg", i + 1), 0.0) * kDeg;
      row.qd_rad_s[i] = value(fmt::format("qd{}_deg_s", i + 1), 0.0) * kDeg;
      row.qdd_rad_s2[i] = value(fmt::format("qdd{}_deg_s2", i + 1), 0.0) * kDeg;
      if (table.tau) row.tau_Nm[i] = value(fmt::format("tau{}_Nm", i + 1), 0.0);
    }
    row.xyz_m = Eigen::Vector3d(value("x_mm", 0.0), value("y_mm", 0.0), value("z_mm", 0.0)) * 1e-3;
    row.range_m = value("range_mm", 0.0) * 1e-3;
    table.rows.push_back(row);
  }
  FillLastMoves(table.rows);
  return table;
}

void WriteTable(const Table& table, const std::string& path) {
  std::string text;
  const int n = table.rows.empty() ? 0 : int(table.rows[0].q_rad.size());
  const auto names = [&](const char* start, const char* end) {
    for (int i = 1; i <= n; ++i) text += fmt::format("{}{}{},", start, i, end);
  };
  if (table.session) text += "session,";
  if (table.t) text += "t_s,";
  const auto slides = [&](int i) {
    return std::size_t(i) < table.prismatic.size() && table.prismatic[std::size_t(i)];
  };
  for (int i = 0; i < n; ++i) text += fmt::format("q{}_{},", i + 1, slides(i) ? "mm" : "deg");
  if (table.qd) names("qd", "_deg_s");
  if (table.qdd) names("qdd", "_deg_s2");
  if (table.payload) text += "payload_kg,";
  if (table.temp) text += "temp_C,";
  if (table.pressure) text += "air_pressure_bar,";
  if (table.tilt) text += "tilt_x_deg,tilt_y_deg,";
  if (table.xyz) text += "x_mm,y_mm,z_mm,";
  if (table.axes) text += "qw,qx,qy,qz,";
  if (table.range) text += "range_mm,";
  if (table.artefact) text += "artefact,";
  if (table.gauge) text += "gauge_mm,";
  text.back() = '\n';
  for (const Row& row : table.rows) {
    const auto number = [&](double value) {
      fmt::format_to(std::back_inserter(text), "{:.5f},", value);
    };
    const auto angles = [&](const Eigen::VectorXd& values) {
      for (const double value : values) number(value / kDeg);
    };
    if (table.session) text += row.session + ",";
    if (table.t) number(row.t_s);
    for (int i = 0; i < n; ++i) number(slides(i) ? row.q_rad[i] * 1e3 : row.q_rad[i] / kDeg);
    if (table.qd) angles(row.qd_rad_s);
    if (table.qdd) angles(row.qdd_rad_s2);
    if (table.payload) number(row.payload_kg);
    if (table.temp) number(row.temp_C);
    if (table.pressure) number(row.pressure_bar);
    if (table.tilt) angles(row.tilt_rad);
    if (table.xyz) {
      for (const double value : row.xyz_m) number(value * 1e3);
    }
    if (table.axes) {
      const Eigen::Quaterniond turn(row.axes);
      text += fmt::format("{:.9f},{:.9f},{:.9f},{:.9f},", turn.w(), turn.x(), turn.y(), turn.z());
    }
    if (table.range) number(row.range_m * 1e3);
    if (table.artefact) text += row.artefact + ",";
    if (table.gauge && std::isnan(row.gauge_m)) text += ",";
    if (table.gauge && !std::isnan(row.gauge_m)) number(row.gauge_m * 1e3);
    text.back() = '\n';
  }
  std::ofstream(path) << text;
}

void WritePoints(const std::vector<Eigen::Vector3d>& points_m, const std::string& path) {
  std::string text = "x_mm,y_mm,z_mm\n";
  for (const Eigen::Vector3d& p : points_m) {
    text += fmt::format("{:.5f},{:.5f},{:.5f}\n", p.x() * 1e3, p.y() * 1e3, p.z() * 1e3);
  }
  std::ofstream(path) << text;
}

}  // namespace simulator
