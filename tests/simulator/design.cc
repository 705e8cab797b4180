#include "tests/simulator/design.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>

namespace simulator {
namespace {

constexpr double kDuration_s = 5400.0;

Eigen::VectorXd RandomJoints(const Cell& cell, Generator& random) {
  Eigen::VectorXd q(int(cell.joints.size()));
  for (int i = 0; i < q.size(); ++i) {
    q[i] = Uniform(random, cell.joints[i].min_rad, cell.joints[i].max_rad);
  }
  return q;
}

/// Adjusts the second-to-last axes until the flange points straight down; false if the limits or
/// the iteration count prevent it.
bool PointDown(const Cell& cell, Row& row) {
  const Changes none(int(cell.joints.size()));
  const Arm arm(cell, none);
  const int i = int(cell.joints.size()) - 3;
  const auto lean = [&] { return Eigen::Vector2d(arm.FlangeAt(row).axes.block<2, 1>(0, 2)); };
  for (int iteration = 0; iteration < 40; ++iteration) {
    const Eigen::Vector2d off = lean();
    if (off.norm() < 1e-6) {
      for (int k = i; k <= i + 1; ++k) {
        if (row.q_rad[k] < cell.joints[k].min_rad || row.q_rad[k] > cell.joints[k].max_rad) {
          return false;
        }
      }
      return arm.FlangeAt(row).axes(2, 2) < 0.0;
    }
    Eigen::Matrix2d slope;
    for (int k = 0; k < 2; ++k) {
      row.q_rad[i + k] += 1e-6;
      slope.col(k) = (lean() - off) / 1e-6;
      row.q_rad[i + k] -= 1e-6;
    }
    Eigen::Vector2d step = slope.fullPivLu().solve(-off);
    if (step.norm() > 0.5) step *= 0.5 / step.norm();
    row.q_rad.segment<2>(i) += step;
  }
  return false;
}

/// A hall that warms up and fluctuates, with local jitter at the sensor.
struct Hall {
  explicit Hall(Generator& random)
      : rise(Uniform(random, 4, 12)),
        rise_s(Uniform(random, 1000, 4000)),
        wave(Uniform(random, 1, 3)),
        period_s(Uniform(random, 1500, 4500)),
        phase(Uniform(random, 0, 6.28)),
        pressure_period_s(Uniform(random, 1800, 3600)),
        pressure_phase(Uniform(random, 0, 6.28)) {}

  double Temperature(double t_s, double start_C, bool steady, Generator& random) const {
    if (steady) return start_C + rise * t_s / kDuration_s + 0.02 * Normal(random);
    return start_C + rise * (1.0 - std::exp(-t_s / rise_s)) +
           wave * (std::sin(2 * M_PI * t_s / period_s + phase) - std::sin(phase)) +
           0.35 * Normal(random);
  }
  double Pressure(double t_s, Generator& random) const {
    return 1.0 + 0.02 * std::sin(2 * M_PI * t_s / pressure_period_s + pressure_phase) +
           0.01 * Normal(random);
  }

  /// A floor that follows a nearby press and settles, 0.05 degrees.
  Eigen::Vector2d Tilt(double t_s, Generator& random) const {
    const double way = 2 * M_PI * t_s / pressure_period_s + pressure_phase;
    return 0.05 * kDeg *
           Eigen::Vector2d(std::sin(way) + 0.3 * Normal(random),
                           t_s / kDuration_s - 0.5 + 0.3 * Normal(random));
  }

  double rise, rise_s, wave, period_s, phase, pressure_period_s, pressure_phase;
};

Row RandomPose(const Cell& cell, const Design& design, Generator& random) {
  Row row;
  row.qd_rad_s = row.qdd_rad_s2 = row.last_move_rad =
      Eigen::VectorXd::Zero(int(cell.joints.size()));
  for (int attempt = 0; attempt < 1000; ++attempt) {
    row.q_rad = RandomJoints(cell, random);
    if (!design.vertical || PointDown(cell, row)) break;
    if (attempt == 999) throw std::runtime_error("no pose with a vertical tool found");
  }
  const auto& payloads = cell.payloads_kg;
  row.payload_kg = design.vertical || design.one_payload
                       ? payloads[payloads.size() / 2]
                       : payloads[std::size_t(Uniform(random, 0, double(payloads.size())))];
  return row;
}

/// Fills in time, temperature, pressure, speed and session of a pose.
void FillConditions(const Cell& cell, const Design& design, const Hall& hall, Row& row,
                    Generator& random) {
  const int n = int(cell.joints.size());
  row.t_s = Uniform(random, 0.0, kDuration_s);
  row.temp_C = hall.Temperature(row.t_s, cell.reference_temperature_C, design.steady_rise, random);
  row.pressure_bar = hall.Pressure(row.t_s, random);
  if (design.tilt) row.tilt_rad = hall.Tilt(row.t_s, random);
  if (design.dynamic) {
    for (int i = 0; i < n; ++i) {
      const double speed = i < n / 2 ? 55.0 : 100.0;
      row.qd_rad_s[i] = Uniform(random, -speed, speed) * kDeg;
      row.qdd_rad_s2[i] = Uniform(random, -3.0 * speed, 3.0 * speed) * kDeg;
    }
  }
  if (design.sessions > 1) {
    row.session = std::to_string(1 + int(row.t_s / kDuration_s * design.sessions));
  }
}

void Order(std::vector<Row>& rows) {
  std::sort(rows.begin(), rows.end(), [](const Row& a, const Row& b) { return a.t_s < b.t_s; });
  RoundAsWritten(rows);
  FillLastMoves(rows);
}

}  // namespace

Tables DrawDesign(const Cell& cell, const Design& design, Generator& random) {
  const Hall hall(random);
  Tables tables;
  std::vector<Row>& measured = tables.measured.rows;
  for (int k = 0; k < design.rows; ++k) measured.push_back(RandomPose(cell, design, random));
  const int revisited = std::max(1, std::min(design.rows, design.repeats / 2));
  for (int k = 0; k < design.repeats; ++k) {
    measured.push_back(measured[std::size_t(Uniform(random, 0, revisited))]);
  }
  for (int k = 0; k < design.tests; ++k) {
    tables.tests.rows.push_back(RandomPose(cell, design, random));
  }
  for (Table* table : {&tables.measured, &tables.tests}) {
    for (Row& row : table->rows) FillConditions(cell, design, hall, row, random);
    if (table == &tables.tests) {
      for (Row& row : table->rows) row.temp_C += design.tests_warmer_K;
    }
    Order(table->rows);
    table->t = table->temp = true;
    table->payload = cell.payload_cog_m.has_value();
    table->session = design.sessions > 1;
    table->qd = table->qdd = design.dynamic;
    table->pressure = design.pressure;
    table->tilt = design.tilt;
    for (const Joint& joint : cell.joints) table->prismatic.push_back(joint.prismatic);
  }
  tables.measured.xyz = true;
  return tables;
}

Tables DesignAt(const Table& poses, Cell cell, const Design& design, Generator& random) {
  Tables tables{poses, {}};
  tables.measured.xyz = true;
  std::set<double> payloads;
  for (const Row& row : poses.rows) payloads.insert(row.payload_kg);
  cell.payloads_kg.assign(payloads.begin(), payloads.end());
  for (std::size_t i = 0; i < cell.joints.size(); ++i) {
    const auto by_angle = [i](const Row& a, const Row& b) { return a.q_rad[i] < b.q_rad[i]; };
    const auto [low, high] = std::minmax_element(poses.rows.begin(), poses.rows.end(), by_angle);
    cell.joints[i].min_rad = low->q_rad[i];
    cell.joints[i].max_rad = high->q_rad[i];
  }
  tables.tests = poses;
  tables.tests.rows.clear();
  for (int k = 0; k < design.tests; ++k) {
    Row row = RandomPose(cell, design, random);
    const auto like = std::uniform_int_distribution<std::size_t>(0, poses.rows.size() - 1)(random);
    row.t_s = poses.rows[like].t_s;
    row.temp_C = poses.rows[like].temp_C;
    tables.tests.rows.push_back(row);
  }
  Order(tables.tests.rows);
  return tables;
}

}  // namespace simulator
