#include "tests/simulator/design.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace simulator {
namespace {

constexpr double kDuration_s = 5400.0;

double Normal(Generator& random) {
  return std::normal_distribution<double>()(random);
}

Eigen::VectorXd RandomJoints(const Cell& cell, Generator& random) {
  Eigen::VectorXd q(int(cell.joints.size()));
  for (int i = 0; i < q.size(); ++i) {
    q[i] = Uniform(random, cell.joints[i].min_rad, cell.joints[i].max_rad);
  }
  return q;
}

/// Turns the last axes but one until the flange points straight down; false where the limits or
/// the iteration end it.
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

/// A hall that warms up and breathes, with jitter of the sensor's surroundings.
struct Hall {
  explicit Hall(Generator& random)
      : rise(Uniform(random, 4, 12)),
        rise_s(Uniform(random, 1000, 4000)),
        wave(Uniform(random, 1, 3)),
        period_s(Uniform(random, 1500, 4500)),
        phase(Uniform(random, 0, 6.28)),
        pressure_period_s(Uniform(random, 1800, 3600)),
        pressure_phase(Uniform(random, 0, 6.28)) {}

  double Temperature(double t_s, double start_C, Generator& random) const {
    return start_C + rise * (1.0 - std::exp(-t_s / rise_s)) +
           wave * (std::sin(2 * M_PI * t_s / period_s + phase) - std::sin(phase)) +
           0.35 * Normal(random);
  }
  double Pressure(double t_s, Generator& random) const {
    return 1.0 + 0.02 * std::sin(2 * M_PI * t_s / pressure_period_s + pressure_phase) +
           0.01 * Normal(random);
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

/// Time, temperature, pressure, speed and session of a pose.
void Circumstances(const Cell& cell, const Design& design, const Hall& hall, Row& row,
                   Generator& random) {
  const int n = int(cell.joints.size());
  row.t_s = Uniform(random, 0.0, kDuration_s);
  row.temp_C = hall.Temperature(row.t_s, cell.reference_temperature_C, random);
  row.pressure_bar = hall.Pressure(row.t_s, random);
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
    for (Row& row : table->rows) Circumstances(cell, design, hall, row, random);
    Order(table->rows);
    table->t = table->temp = true;
    table->payload = cell.payload_cog_m.has_value();
    table->session = design.sessions > 1;
    table->qd = table->qdd = design.dynamic;
    table->pressure = design.pressure;
  }
  tables.measured.xyz = true;
  return tables;
}

std::vector<int> Measure(const Cell& cell, const Design& design,
                         const std::vector<Eigen::Vector3d>& truth_m, Table& measured,
                         Generator& random) {
  const std::size_t rows = measured.rows.size();
  for (std::size_t k = 0; k < rows; ++k) {
    // Student's t with 3 degrees of freedom: variance 3, scaled to the same sigma at its quartiles.
    for (int axis = 0; axis < 3; ++axis) {
      double noise = Normal(random);
      if (design.heavy_tails) {
        double square = 0.0;
        for (int i = 0; i < 3; ++i) square += std::pow(Normal(random), 2);
        noise *= 0.882 / std::sqrt(square / 3.0);
      }
      measured.rows[k].xyz_m[axis] = truth_m[k][axis] + cell.sigma_m * noise;
    }
  }
  std::vector<std::size_t> order(rows);
  for (std::size_t k = 0; k < rows; ++k) order[k] = k;
  std::shuffle(order.begin(), order.end(), random);
  order.resize(std::size_t(std::lround(design.outliers * double(rows))));
  std::vector<int> lines;
  for (const std::size_t k : order) {
    const Eigen::Vector3d direction(Normal(random), Normal(random), Normal(random));
    measured.rows[k].xyz_m += direction.normalized() * cell.sigma_m * Uniform(random, 10, 100);
    lines.push_back(int(k) + 2);
  }
  std::sort(lines.begin(), lines.end());
  return lines;
}

}  // namespace simulator
