#include "app/measure/diagnosis/linear/frame_start.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "firmware-like/geometry/rotation.h"

namespace plumbline::measure {
namespace {

/// A row for the initial estimate: flange pose in B and measured tip in W.
struct FlangePoint {
  Pose X_BF;
  Vec3 p_W;
};

struct Start {
  Pose X_WB;
  Vec3 tip_F = Vec3::Zero();
  double rms_m = 0;
};

using Vector9 = Eigen::Matrix<double, 9, 1>;

/// Gauss-Newton step to the maximum a posteriori frames, from rows of variance `variance_m2` and
/// the prior. Only the tip has a prior mean (the declared one); the base is damped about its
/// current value.
/// @param information  receives the posterior precision
Vector9 StepOf(const Eigen::Matrix<double, 9, 9>& H, const Vector9& g, double variance_m2,
               const FramePrior& prior, const Vec3& tip_F,
               Eigen::Matrix<double, 9, 9>& information) {
  information = H / variance_m2;
  information.diagonal() += prior.information;
  Vector9 right = g / variance_m2;
  right.tail<3>() += prior.information.tail<3>().cwiseProduct(prior.tip_F - tip_F);
  return information.ldlt().solve(right);
}

double RmsOf(const std::vector<FlangePoint>& points, const Start& start) {
  double sum = 0;
  for (const FlangePoint& point : points) {
    sum += (point.p_W - start.X_WB * (point.X_BF * start.tip_F)).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(points.size()));
}

/// Gauss-Newton on base and tip (9 parameters), each only if it is free.
void Polish(const std::vector<FlangePoint>& points, bool frame_free, bool tip_free,
            const FramePrior& prior, Start& start) {
  constexpr int kPasses = 30;
  constexpr double kMinScale_m = 1e-4;  // residual of an unloaded arm
  double damping = 1e-9;
  start.rms_m = RmsOf(points, start);
  for (int pass = 0; pass < kPasses; ++pass) {
    Eigen::Matrix<double, 9, 9> H = Eigen::Matrix<double, 9, 9>::Zero();
    Eigen::Matrix<double, 9, 1> g = Eigen::Matrix<double, 9, 1>::Zero();
    for (const FlangePoint& point : points) {
      const Vec3 p_B = point.X_BF * start.tip_F;
      const Vec3 p_W = start.X_WB * p_B;
      Eigen::Matrix<double, 3, 9> J;
      J.leftCols<3>().setIdentity();
      for (int axis = 0; axis < 3; ++axis) {
        J.col(3 + axis) = Vec3::Unit(axis).cross(p_W - start.X_WB.p);
      }
      J.rightCols<3>() = start.X_WB.R * point.X_BF.R;
      if (!frame_free) J.leftCols<6>().setZero();
      if (!tip_free) J.rightCols<3>().setZero();
      H += J.transpose() * J;
      g += J.transpose() * (point.p_W - p_W);
    }
    H.diagonal().array() += damping * H.diagonal().maxCoeff();
    const double scale_m = std::max(start.rms_m, kMinScale_m);
    Eigen::Matrix<double, 9, 9> information;
    const Vector9 step = StepOf(H, g, scale_m * scale_m, prior, start.tip_F, information);
    Model::Frames frames{start.X_WB, start.tip_F};
    MoveFrames(frames, step);
    Start next{frames.X_WB, frames.tip_F};
    next.rms_m = RmsOf(points, next);
    if (next.rms_m > start.rms_m) {
      damping = std::max(1e-9, damping) * 100;
      if (damping > 1) return;
      continue;
    }
    const double gained = start.rms_m - next.rms_m;
    start = next;
    damping = std::max(1e-12, damping / 10);
    if (gained < 1e-9 * start.rms_m) return;
  }
}

/// Solves p_W = R p_BF + (R (x) t) vec(R_BF) + b, linear in its 3 (3 + 9 + 1) unknowns, for base
/// and tip; nullopt for fewer than 16 points or a degenerate solution.
std::optional<Start> LiftedStart(const std::vector<FlangePoint>& points) {
  const auto count = static_cast<int>(points.size());
  if (count < 16) return std::nullopt;
  Eigen::MatrixXd A(count, 13);
  Eigen::MatrixXd b(count, 3);
  for (int k = 0; k < count; ++k) {
    const FlangePoint& point = points[k];
    A.block<1, 3>(k, 0) = point.X_BF.p.transpose();
    for (int column = 0; column < 3; ++column) {
      A.block<1, 3>(k, 3 + 3 * column) = point.X_BF.R.col(column).transpose();
    }
    A(k, 12) = 1;
    b.row(k) = point.p_W.transpose();
  }
  const Eigen::MatrixXd x = A.colPivHouseholderQr().solve(b);
  const Mat3 R = x.topRows<3>().transpose();
  const Eigen::JacobiSVD<Mat3> svd(R, Eigen::ComputeFullU | Eigen::ComputeFullV);
  if (svd.singularValues()[2] < 0.3) return std::nullopt;
  Mat3 U = svd.matrixU();
  if ((U * svd.matrixV().transpose()).determinant() < 0) U.col(2) *= -1;
  Start start;
  start.X_WB.R = U * svd.matrixV().transpose();
  start.X_WB.p = x.row(12).transpose();
  for (int column = 0; column < 3; ++column) {
    const Mat3 scaled = x.block<3, 3>(3 + 3 * column, 0).transpose();
    start.tip_F[column] = (start.X_WB.R.transpose() * scaled).trace() / 3;
  }
  return start;
}

/// The 24 rotations of a cube.
std::vector<Mat3> CubeRotations() {
  std::vector<Mat3> rotations;
  for (int x = 0; x < 3; ++x) {
    for (int y = 0; y < 3; ++y) {
      if (x == y) continue;
      for (int signs = 0; signs < 4; ++signs) {
        Mat3 R = Mat3::Zero();
        R(x, 0) = (signs & 1) != 0 ? -1 : 1;
        R(y, 1) = (signs & 2) != 0 ? -1 : 1;
        R.col(2) = R.col(0).cross(R.col(1));
        rotations.push_back(R);
      }
    }
  }
  return rotations;
}

/// Start with a given orientation of the base; its position follows from the mean of the points.
Start StartAt(const std::vector<FlangePoint>& points, const Mat3& R, const Vec3& tip_F) {
  Start start{{R, Vec3::Zero()}, tip_F};
  for (const FlangePoint& point : points) {
    start.X_WB.p += (point.p_W - R * (point.X_BF * tip_F)) / static_cast<double>(points.size());
  }
  return start;
}

Start BestStart(const std::vector<FlangePoint>& points, const Model::Frames& declared,
                bool frame_free, bool tip_free, const FramePrior& prior) {
  std::vector<Start> starts = {{declared.X_WB, declared.tip_F}};
  if (frame_free) {
    if (const auto lifted = LiftedStart(points)) {
      starts.push_back(*lifted);
      if (!tip_free) starts.back().tip_F = declared.tip_F;
    }
    for (const Mat3& R : CubeRotations()) starts.push_back(StartAt(points, R, declared.tip_F));
  }
  for (Start& start : starts) Polish(points, frame_free, tip_free, prior, start);
  return *std::ranges::min_element(
      starts, [](const Start& a, const Start& b) { return a.rms_m < b.rms_m; });
}

/// At most `most` rows of the session, evenly spread.
std::vector<RowIndex> SomeRows(const Dataset& data, SessionIndex session, int most) {
  std::vector<RowIndex> all;
  for (const RowIndex row : data.row_indices()) {
    if (data.session_of[row] == session) all.push_back(row);
  }
  std::vector<RowIndex> some;
  const auto count = static_cast<int>(all.size());
  const int taken = std::min(most, count);
  some.reserve(taken);
  for (int j = 0; j < taken; ++j) {
    some.push_back(all[std::int64_t{j} * count / taken]);
  }
  return some;
}

}  // namespace

FramePrior FramePriorOf(const Vec3& tip_F, bool frame_free, bool tip_free) {
  constexpr double kTip_m = 0.05, kBase_m = 5, kTurn_rad = 1, kFixed = 1e-9;
  const auto information = [](bool free, double sd) { return 1 / std::pow(free ? sd : kFixed, 2); };
  FramePrior prior;
  prior.information.head<3>().setConstant(information(frame_free, kBase_m));
  prior.information.segment<3>(3).setConstant(information(frame_free, kTurn_rad));
  prior.information.tail<3>().setConstant(information(tip_free, kTip_m));
  prior.tip_F = tip_F;
  return prior;
}

void StartFrames(const Dataset& data, const Indexed<SessionIndex, FramePrior>& priors,
                 Model& model) {
  constexpr int kRowsForStart = 300;
  for (const SessionIndex session : data.sessions.indices()) {
    Model::Frames& frames = model.frames[session];
    const deflection::LoadedArm arm(CellOf(data, model, session));
    std::vector<FlangePoint> points;
    for (const RowIndex index : SomeRows(data, session, kRowsForStart)) {
      const ObservationKind kind = data.observations[index].kind;
      if (kind != ObservationKind::kPosition && kind != ObservationKind::kPose) continue;
      const MeasuredRow& row = data.measured(index);
      kinematics::Posture posture;
      arm.chain().Evaluate(row.q, posture);
      points.push_back({posture.X_BF(), *row.measured_W});
    }
    if (points.empty()) continue;  // the frames start as declared
    const Start start =
        BestStart(points, frames, data.frames_free(), data.tip_free(), priors[session]);
    frames.X_WB = start.X_WB;
    frames.tip_F = start.tip_F;
  }
}

}  // namespace plumbline::measure
