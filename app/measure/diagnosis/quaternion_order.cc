#include "app/measure/diagnosis/quaternion_order.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <cmath>

#include "firmware-like/geometry/angle.h"
#include "firmware-like/geometry/rotation.h"
#include "firmware-like/statistics/median.h"

namespace plumbline::measure {
namespace {

using Quaternion = Eigen::Quaterniond;

constexpr double kWrong_rad = 5 * kRadPerDeg;
constexpr double kRight_rad = 1 * kRadPerDeg;
constexpr double kLargestTurn_rad = 150 * kRadPerDeg;
constexpr std::size_t kMinTurns = 6;

Quaternion AsWritten(const Quaternion& read) {
  return read;
}

Quaternion Inverse(const Quaternion& read) {
  return read.conjugate();
}

/// Rotation vectors from each row to the next, in the rotated frame; shape (3, rows - 1).
Eigen::Matrix3Xd Turns(const std::vector<Quaternion>& orientations,
                       Quaternion (*undo)(const Quaternion&)) {
  Eigen::Matrix3Xd turns(3, static_cast<Eigen::Index>(orientations.size()) - 1);
  for (std::size_t k = 1; k < orientations.size(); ++k) {
    const Quaternion turn = undo(orientations[k - 1]).conjugate() * undo(orientations[k]);
    turns.col(static_cast<Eigen::Index>(k) - 1) = VectorFromRotation(turn.toRotationMatrix());
  }
  return turns;
}

/// Median difference between the measured turns and the predicted ones [rad], after the constant
/// rotation between the two tool frames, by least squares.
double MedianDifference(const std::vector<Quaternion>& measured,
                        const std::vector<Quaternion>& predicted,
                        const std::vector<SessionIndex>& sessions,
                        Quaternion (*undo)(const Quaternion&)) {
  const Eigen::Matrix3Xd of_measured = Turns(measured, undo);
  const Eigen::Matrix3Xd of_predicted = Turns(predicted, AsWritten);
  std::vector<Eigen::Index> clear;  // turns near 180 deg may have either sign
  for (Eigen::Index k = 0; k < of_predicted.cols(); ++k) {
    const auto row = static_cast<std::size_t>(k);
    const bool same_session = sessions[row] == sessions[row + 1];
    if (same_session && of_predicted.col(k).norm() < kLargestTurn_rad) clear.push_back(k);
  }
  if (clear.size() < kMinTurns) return HUGE_VAL;
  const Eigen::Matrix3Xd from = of_predicted(Eigen::all, clear);
  const Eigen::Matrix3Xd to = of_measured(Eigen::all, clear);
  const Eigen::JacobiSVD<Mat3> svd(to * from.transpose(),
                                   Eigen::ComputeFullU | Eigen::ComputeFullV);
  Vec3 signs(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant());
  const Mat3 R = svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
  std::vector<double> differences;
  for (Eigen::Index k = 0; k < from.cols(); ++k) {
    differences.push_back((to.col(k) - R * from.col(k)).norm());
  }
  return statistics::MedianOf(differences);
}

}  // namespace

std::optional<std::string> QuaternionsInOtherOrder(const Dataset& data) {
  const deflection::LoadedArm arm(data.cell);
  std::vector<Quaternion> measured, predicted;
  std::vector<SessionIndex> sessions;
  for (const RowIndex row : data.row_indices()) {
    if (data.observations[row].kind != ObservationKind::kPose) continue;
    sessions.push_back(data.session_of[row]);
    deflection::LoadedState state;
    arm.AtActual(data.measured(row).q, data.payloads[row], data.conditions[row], state);
    measured.push_back(*data.measured(row).orientation_W);
    predicted.emplace_back(state.X_WT.R);
  }
  if (measured.size() <= kMinTurns) return std::nullopt;
  const double before = MedianDifference(measured, predicted, sessions, AsWritten);
  if (before < kWrong_rad || !std::isfinite(before)) return std::nullopt;
  const double after = MedianDifference(measured, predicted, sessions, Inverse);
  if (after > kRight_rad) return std::nullopt;
  return fmt::format(
      "the rotations between successive rows differ by {:.0f} deg (median) from those of the "
      "joints, "
      "but only by {:.2g} deg if the quaternions are in the order x, y, z, w or inverted. If the "
      "order is x, y, z, w, write the header as qx, qy, qz, qw; if they are inverted, negate qx, "
      "qy, qz",
      before / kRadPerDeg, after / kRadPerDeg);
}

}  // namespace plumbline::measure
