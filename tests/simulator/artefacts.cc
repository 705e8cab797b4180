#include "tests/simulator/artefacts.h"

#include <fmt/core.h>

#include <Eigen/Dense>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace simulator {
namespace {

constexpr double kApart_m = 0.05;    // of the two sockets of a printed tool
constexpr double kPrinted_m = 5e-5;  // standard deviation of that distance
constexpr double kGaugeTravel_m = 3e-3;

Eigen::Vector3d RandomDirection(Generator& random) {
  Eigen::Vector3d v(Normal(random), Normal(random), Normal(random));
  return v.normalized();
}

const Row& AnyRow(const std::vector<Row>& rows, Generator& random) {
  return rows[std::uniform_int_distribution<std::size_t>(0, rows.size() - 1)(random)];
}

/// The last move of row k, from the rows before it.
void SetLastMove(std::vector<Row>& rows, std::size_t k) {
  rows[k].last_move_rad = Eigen::VectorXd::Zero(rows[k].q_rad.size());
  if (k == 0) return;
  for (int i = 0; i < rows[k].q_rad.size(); ++i) {
    const double move = rows[k].q_rad[i] - rows[k - 1].q_rad[i];
    rows[k].last_move_rad[i] = move != 0.0 ? move : rows[k - 1].last_move_rad[i];
  }
}

double RoundedAngle(double angle) {
  return std::round(angle / kDeg * 1e5) / 1e5 * kDeg;
}

/// Newton's method with numerical derivatives and steps of least length; false if it does not
/// converge within the joint limits.
/// @param wanted  directions (columns) along which the tip must reach the target
bool Reach(const Arm& arm, const Cell& cell, const Eigen::MatrixXd& wanted,
           const Eigen::Vector3d& target_m, std::vector<Row>& rows, std::size_t k) {
  constexpr double kStep_rad = 1e-6, kClose_m = 2e-8, kLongest_rad = 0.3;
  Row& row = rows[k];
  for (int pass = 0; pass < 60; ++pass) {
    SetLastMove(rows, k);
    const Eigen::Vector3d tip_m = arm.Tip(row);
    const Eigen::VectorXd left = wanted.transpose() * (target_m - tip_m);
    if (left.norm() < kClose_m) {
      for (int i = 0; i < row.q_rad.size(); ++i) {
        const Joint& joint = cell.joints[std::size_t(i)];
        if (row.q_rad[i] < joint.min_rad || row.q_rad[i] > joint.max_rad) return false;
      }
      return true;
    }
    Eigen::MatrixXd J(wanted.cols(), row.q_rad.size());
    for (int i = 0; i < row.q_rad.size(); ++i) {
      Row moved = row;
      moved.q_rad[i] += kStep_rad;
      J.col(i) = wanted.transpose() * (arm.Tip(moved) - tip_m) / kStep_rad;
    }
    Eigen::VectorXd step = J.completeOrthogonalDecomposition().solve(left);
    if (step.norm() > kLongest_rad) step *= kLongest_rad / step.norm();
    row.q_rad += step;
  }
  return false;
}

/// Finds a posture that reaches the target from the row's own, or else from those of other rows.
void ReachFromAnywhere(const Arm& arm, const Cell& cell, const Eigen::MatrixXd& wanted,
                       const Eigen::Vector3d& target_m, const std::vector<Row>& starts,
                       std::vector<Row>& rows, std::size_t k, Generator& random) {
  for (int attempt = 0; attempt < 500; ++attempt) {
    if (Reach(arm, cell, wanted, target_m, rows, k)) return;
    rows[k].q_rad = AnyRow(starts, random).q_rad;
  }
  throw std::runtime_error(fmt::format("row {}: no posture reaches its artefact", k + 1));
}

/// True if many starts lead to the place, so that it is touched in many postures.
bool IsReached(const Arm& arm, const Cell& cell, const Eigen::Vector3d& at_m,
               const std::vector<Row>& starts, Generator& random) {
  constexpr int kStarts = 12, kEnough = 4;
  int reached = 0;
  for (int start = 0; start < kStarts; ++start) {
    std::vector<Row> rows = {AnyRow(starts, random)};
    if (Reach(arm, cell, Eigen::Matrix3d::Identity(), at_m, rows, 0)) ++reached;
  }
  return reached >= kEnough;
}

}  // namespace

Artefacts DrawArtefacts(const std::string& what, int places, const Cell& cell,
                        const std::vector<Row>& rows, Generator& random) {
  const Changes none({}, int(cell.joints.size()));
  const Arm arm(cell, none);
  const auto tip = [&] { return arm.Tip(AnyRow(rows, random)); };
  const auto reachable_tip = [&] {
    for (;;) {
      const Eigen::Vector3d at_m = tip();
      if (IsReached(arm, cell, at_m, rows, random)) return at_m;
    }
  };
  Artefacts artefacts;
  if (what == "sockets") {
    for (int place = 0; place < places; ++place) {
      const Eigen::Vector3d at_m = reachable_tip();
      Eigen::Vector3d other_m = at_m;
      do {
        other_m = at_m + kApart_m * RandomDirection(random);
      } while (!IsReached(arm, cell, other_m, rows, random));
      artefacts.pairs.push_back({artefacts.all.size(), artefacts.all.size() + 1, kApart_m});
      artefacts.all.push_back(
          {fmt::format("tool{}_0", place), "point", at_m, Eigen::Vector3d::UnitZ()});
      artefacts.all.push_back(
          {fmt::format("tool{}_1", place), "point", other_m, Eigen::Vector3d::UnitZ()});
    }
  } else if (what == "gauges") {
    const Eigen::Vector3d tilted(Uniform(random, -0.1, 0.1), Uniform(random, -0.1, 0.1), 1.0);
    artefacts.all.push_back({"table", "plane", tip(), tilted.normalized()});
    for (int gauge = 0; gauge < 3; ++gauge) {
      artefacts.all.push_back(
          {fmt::format("gauge{}", gauge), "gauge", reachable_tip(), RandomDirection(random)});
    }
  } else if (what == "wires") {
    for (int wire = 0; wire < places; ++wire) {
      artefacts.all.push_back({fmt::format("wire{}", wire), "point",
                               1.5 * tip() + 0.5 * RandomDirection(random),
                               Eigen::Vector3d::UnitZ()});
    }
  } else {
    throw std::runtime_error("--artefacts " + what + ": use sockets, gauges or wires");
  }
  return artefacts;
}

void TouchArtefacts(const Artefacts& artefacts, const Cell& cell, const Effects& effects,
                    Table& table, Generator& random) {
  const Changes changes(effects, int(cell.joints.size()));
  const Arm arm(cell, changes);
  const std::vector<Row> starts = table.rows;
  const auto noise = [&] { return cell.sigma_m * Normal(random); };
  const auto noise3 = [&] { return Eigen::Vector3d(noise(), noise(), noise()); };
  const bool wires = artefacts.all.front().name.starts_with("wire");
  table.xyz = false;
  table.artefact = true;
  table.range = wires;
  table.gauge = artefacts.all.back().kind == "gauge";
  for (std::size_t k = 0; k < table.rows.size(); ++k) {
    Row& row = table.rows[k];
    const Artefact& artefact = artefacts.all[k % artefacts.all.size()];
    row.artefact = artefact.name;
    row.range_m = row.gauge_m = std::numeric_limits<double>::quiet_NaN();
    const Eigen::Matrix3d everywhere = Eigen::Matrix3d::Identity();
    if (wires) {
      SetLastMove(table.rows, k);
      row.range_m = (arm.Tip(row) - artefact.at_m).norm() + noise();
    } else if (artefact.kind == "point") {
      ReachFromAnywhere(arm, cell, everywhere, artefact.at_m + noise3(), starts, table.rows, k,
                        random);
    } else if (artefact.kind == "plane") {
      ReachFromAnywhere(arm, cell, artefact.direction, artefact.at_m + noise() * artefact.direction,
                        starts, table.rows, k, random);
    } else {
      const Eigen::Vector3d beside(Uniform(random, -1, 1), Uniform(random, -1, 1),
                                   Uniform(random, -1, 1));
      ReachFromAnywhere(arm, cell, everywhere, artefact.at_m + kGaugeTravel_m * beside, starts,
                        table.rows, k, random);
    }
    for (double& angle : row.q_rad) angle = RoundedAngle(angle);
    SetLastMove(table.rows, k);
    if (artefact.kind != "gauge") continue;
    row.gauge_m = artefact.direction.dot(arm.Tip(row) - artefact.at_m) + noise();
  }
}

std::string ArtefactsText(const Artefacts& artefacts) {
  std::string text;
  for (const Artefact& artefact : artefacts.all) {
    text +=
        fmt::format("\n[[artefact]]\nname = \"{}\"\nkind = \"{}\"\n", artefact.name, artefact.kind);
  }
  for (const Artefacts::Pair& pair : artefacts.pairs) {
    text += fmt::format(
        "\n[[distance]]\nbetween = [\"{}\", \"{}\"]\nvalue_mm = {:.6g}\n"
        "sd_mm = {:.6g}\n",
        artefacts.all[pair.first].name, artefacts.all[pair.second].name, 1e3 * pair.distance_m,
        1e3 * kPrinted_m);
  }
  return text;
}

}  // namespace simulator
