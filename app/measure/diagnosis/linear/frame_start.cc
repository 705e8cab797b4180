#include "app/measure/diagnosis/linear/frame_start.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <vector>

#include "firmware-like/geometry/rotation.h"

namespace plumbline::measure {
namespace {

/// A row for the initial estimate: flange pose in B and measured tip in W.
struct FlangePoint {
  Pose X_BF;
  Vec3 p_W;
  int tool = 0;  ///< index, CellModel::ToolAt
};

struct Start {
  Pose X_WB;
  std::vector<Pose> X_FT;
  double rms_m = 0;
};

/// Gauss-Newton step to the maximum a posteriori frames, from rows of variance `variance_m2` and
/// the prior. Only the tip has a prior mean (the declared one); the base is damped about its
/// current value.
Eigen::VectorXd StepOf(const Eigen::MatrixXd& H, const Eigen::VectorXd& g, double variance_m2,
                       const FramePrior& prior, const std::vector<Pose>& X_FT) {
  Eigen::MatrixXd information = H / variance_m2;
  information.diagonal().head<6>() += prior.base_information;
  information.diagonal().tail(H.rows() - 6).array() += prior.tip_information;
  Eigen::VectorXd right = g / variance_m2;
  for (std::size_t tool = 0; tool < X_FT.size(); ++tool) {
    right.segment<3>(static_cast<Eigen::Index>(6 + 3 * tool)) +=
        prior.tip_information * (prior.X_FT[tool].p - X_FT[tool].p);
  }
  return information.ldlt().solve(right);
}

double RmsOf(const std::vector<FlangePoint>& points, const Start& start) {
  double sum = 0;
  for (const FlangePoint& point : points) {
    sum += (point.p_W - start.X_WB * (point.X_BF * start.X_FT[point.tool].p)).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(points.size()));
}

/// Gauss-Newton on base and tips, each only if it is free.
void Polish(const std::vector<FlangePoint>& points, bool frame_free, bool tip_free,
            const FramePrior& prior, Start& start) {
  constexpr int kPasses = 30;
  constexpr double kMinScale_m = 1e-4;  // residual of an unloaded arm
  double damping = 1e-9;
  start.rms_m = RmsOf(points, start);
  for (int pass = 0; pass < kPasses; ++pass) {
    const auto size = static_cast<Eigen::Index>(6 + 3 * start.X_FT.size());
    Eigen::MatrixXd H = Eigen::MatrixXd::Zero(size, size);
    Eigen::VectorXd g = Eigen::VectorXd::Zero(size);
    for (const FlangePoint& point : points) {
      const Vec3 p_B = point.X_BF * start.X_FT[point.tool].p;
      const Vec3 p_W = start.X_WB * p_B;
      Eigen::Matrix<double, 3, 9> J;
      J.leftCols<3>().setIdentity();
      for (int axis = 0; axis < 3; ++axis) {
        J.col(3 + axis) = Vec3::Unit(axis).cross(p_W - start.X_WB.p);
      }
      J.rightCols<3>() = start.X_WB.R * point.X_BF.R;
      if (!frame_free) J.leftCols<6>().setZero();
      if (!tip_free) J.rightCols<3>().setZero();
      const Eigen::Index tip = 6 + 3 * point.tool;
      const auto base = J.leftCols<6>();
      const auto of_tip = J.rightCols<3>();
      H.topLeftCorner<6, 6>() += base.transpose() * base;
      H.block<6, 3>(0, tip) += base.transpose() * of_tip;
      H.block<3, 6>(tip, 0) += of_tip.transpose() * base;
      H.block<3, 3>(tip, tip) += of_tip.transpose() * of_tip;
      g.head<6>() += base.transpose() * (point.p_W - p_W);
      g.segment<3>(tip) += of_tip.transpose() * (point.p_W - p_W);
    }
    H.diagonal().array() += damping * H.diagonal().maxCoeff();
    const double scale_m = std::max(start.rms_m, kMinScale_m);
    const Eigen::VectorXd step = StepOf(H, g, scale_m * scale_m, prior, start.X_FT);
    Start next = start;
    MoveBase(next.X_WB, step.head<6>());
    for (std::size_t tool = 0; tool < next.X_FT.size(); ++tool) {
      next.X_FT[tool].p += step.segment<3>(static_cast<Eigen::Index>(6 + 3 * tool));
    }
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

/// Solves p_W = R p_BF + (R (x) t) vec(R_BF) + b, linear in its 3 (3 + 9 tools + 1) unknowns, for
/// base and tips; nullopt for too few points or a degenerate solution. Tools without a point keep
/// their tips.
std::optional<Start> LiftedStart(const std::vector<FlangePoint>& points,
                                 const std::vector<Pose>& declared) {
  const auto count = static_cast<int>(points.size());
  const auto tools = static_cast<int>(declared.size());
  const int unknowns = 4 + 9 * tools;
  if (count < unknowns + 3) return std::nullopt;
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(count, unknowns);
  Eigen::MatrixXd b(count, 3);
  std::vector<bool> seen(declared.size(), false);
  for (int k = 0; k < count; ++k) {
    const FlangePoint& point = points[k];
    A.block<1, 3>(k, 0) = point.X_BF.p.transpose();
    for (int column = 0; column < 3; ++column) {
      A.block<1, 3>(k, 4 + 9 * point.tool + 3 * column) = point.X_BF.R.col(column).transpose();
    }
    A(k, 3) = 1;
    seen[point.tool] = true;
    b.row(k) = point.p_W.transpose();
  }
  // Of minimum norm where a tool has no point.
  const Eigen::MatrixXd x = A.completeOrthogonalDecomposition().solve(b);
  Start start;
  double smallest = 0;
  start.X_WB.R = NearestRotation(x.topRows<3>().transpose(), &smallest);
  if (smallest < 0.3) return std::nullopt;
  start.X_WB.p = x.row(3).transpose();
  start.X_FT = declared;
  for (int tool = 0; tool < tools; ++tool) {
    for (int column = 0; seen[tool] && column < 3; ++column) {
      const Mat3 scaled = x.block<3, 3>(4 + 9 * tool + 3 * column, 0).transpose();
      start.X_FT[tool].p[column] = (start.X_WB.R.transpose() * scaled).trace() / 3;
    }
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
Start StartAt(const std::vector<FlangePoint>& points, const Mat3& R,
              const std::vector<Pose>& X_FT) {
  Start start{{R, Vec3::Zero()}, X_FT};
  for (const FlangePoint& point : points) {
    start.X_WB.p +=
        (point.p_W - R * (point.X_BF * X_FT[point.tool].p)) / static_cast<double>(points.size());
  }
  return start;
}

Start BestStart(const std::vector<FlangePoint>& points, const Model::Frames& declared,
                bool frame_free, bool tip_free, const FramePrior& prior) {
  std::vector<Start> starts = {{declared.X_WB, declared.X_FT}};
  if (frame_free) {
    if (const auto lifted = LiftedStart(points, declared.X_FT)) {
      starts.push_back(*lifted);
      if (!tip_free) starts.back().X_FT = declared.X_FT;
    }
    for (const Mat3& R : CubeRotations()) starts.push_back(StartAt(points, R, declared.X_FT));
  }
  for (Start& start : starts) Polish(points, frame_free, tip_free, prior, start);
  return *std::ranges::min_element(
      starts, [](const Start& a, const Start& b) { return a.rms_m < b.rms_m; });
}

/// At most `most` rows of each tool in the session, evenly spread.
std::vector<RowIndex> SomeRows(const Dataset& data, SessionIndex session, int most) {
  std::map<int, std::vector<RowIndex>> rows_of_tool;
  for (const RowIndex row : data.row_indices()) {
    if (data.session_of[row] == session) rows_of_tool[data.payloads[row].tool].push_back(row);
  }
  std::vector<RowIndex> some;
  for (const auto& [tool, all] : rows_of_tool) {
    const auto count = static_cast<int>(all.size());
    const int taken = std::min(most, count);
    for (int j = 0; j < taken; ++j) some.push_back(all[std::int64_t{j} * count / taken]);
  }
  return some;
}

}  // namespace

FramePrior FramePriorOf(const std::vector<Pose>& X_FT, bool frame_free, bool tip_free) {
  constexpr double kTip_m = 0.05, kBase_m = 5, kTurn_rad = 1, kFixed = 1e-9;
  const auto information = [](bool free, double sd) { return 1 / std::pow(free ? sd : kFixed, 2); };
  FramePrior prior;
  prior.base_information.head<3>().setConstant(information(frame_free, kBase_m));
  prior.base_information.tail<3>().setConstant(information(frame_free, kTurn_rad));
  prior.tip_information = information(tip_free, kTip_m);
  prior.X_FT = X_FT;
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
      points.push_back({posture.X_BF(), *row.measured_W, data.payloads[index].tool});
    }
    if (points.empty()) continue;  // the frames start as declared
    const Start start =
        BestStart(points, frames, data.frames_free(), data.tip_free(), priors[session]);
    frames.X_WB = start.X_WB;
    frames.X_FT = start.X_FT;
  }
}

}  // namespace plumbline::measure
