#include "app/diagnosis/alignment.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "app/diagnosis/artefact_start.h"
#include "app/diagnosis/nuisances.h"
#include "app/diagnosis/robust.h"
#include "app/diagnosis/whitener.h"
#include "firmware-like/geometry/rotation.h"
#include "firmware-like/statistics/median.h"

namespace plumbline::diagnosis {
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

/// Prior of the frames: the tip is the declared one within 100 mm (95 %); the base is within the
/// cell, in any orientation. Negligible along directions that the rows determine; along the others
/// the declared value is kept. Frames that are not free are fixed by an infinite precision.
struct FramePrior {
  Vector9 information = Vector9::Zero();  ///< 1 / variance; practically infinite if not free
  Vec3 tip_F = Vec3::Zero();
};

FramePrior PriorOf(const Vec3& tip_F, bool frame_free, bool tip_free) {
  constexpr double kTip_m = 0.05, kBase_m = 5, kTurn_rad = 1, kFixed = 1e-9;
  const auto information = [](bool free, double sd) { return 1 / std::pow(free ? sd : kFixed, 2); };
  FramePrior prior;
  prior.information.head<3>().setConstant(information(frame_free, kBase_m));
  prior.information.segment<3>(3).setConstant(information(frame_free, kTurn_rad));
  prior.information.tail<3>().setConstant(information(tip_free, kTip_m));
  prior.tip_F = tip_F;
  return prior;
}

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
    const FlangePoint& point = points[static_cast<std::size_t>(k)];
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
  return *std::min_element(starts.begin(), starts.end(),
                           [](const Start& a, const Start& b) { return a.rms_m < b.rms_m; });
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
  some.reserve(static_cast<std::size_t>(taken));
  for (int j = 0; j < taken; ++j) {
    some.push_back(all[static_cast<std::size_t>(std::int64_t{j} * count / taken)]);
  }
  return some;
}

/// Initial frames of every session, from the unloaded arm.
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
      const table::MeasuredRow& row = data.measured(index);
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

/// Variance of one axis used by the alignment [m^2].
/// @param middle_m  median of SizesOf [m]
double VarianceOf(const Dataset& data, double middle_m) {
  constexpr double kMinSigma_m = 1e-6;
  return std::pow(std::max({middle_m, data.sigma_m, kMinSigma_m}), 2);
}

/// Sizes of the residuals, each divided by the median that it has at unit noise [m].
std::vector<double> SizesOf(const Dataset& data, const Linearisation& linear) {
  std::vector<double> sizes;
  for (const RowIndex row : data.row_indices()) {
    const RowNumbers& numbers = data.numbers[row];
    if (numbers.count == 0) continue;
    sizes.push_back(SizeOf(numbers, linear.rows[row].residual) / MedianOfChi(numbers.count));
  }
  return sizes;
}

/// Precision of the prior of every nuisance, and its mean relative to the model.
struct NuisancePrior {
  Eigen::VectorXd information, offset;
};

/// The prior of the frames (FramePrior). Places of artefacts are anywhere in the cell; like the
/// base, they are damped about their current values.
NuisancePrior PriorAt(const Nuisances& nuisances, const Indexed<SessionIndex, FramePrior>& priors,
                      const Model& model) {
  constexpr double kPlace_m = 5;
  NuisancePrior prior;
  prior.information.setConstant(nuisances.size(), 1 / (kPlace_m * kPlace_m));
  prior.offset.setZero(nuisances.size());
  for (const SessionIndex session : priors.indices()) {
    const FramePrior& of = priors[session];
    int at = nuisances.FirstOf(session);
    if (nuisances.frames()) {
      prior.information.segment<6>(at) = of.information.head<6>();
      at += 6;
    }
    if (!nuisances.tip()) continue;
    prior.information.segment<3>(at) = of.information.tail<3>();
    prior.offset.segment<3>(at) = of.tip_F - model.frames[session].tip_F;
  }
  return prior;
}

/// Precision of the nuisances, and the Gauss-Newton step to their maximum a posteriori.
struct NuisanceStep {
  Eigen::MatrixXd information;
  Eigen::VectorXd step;
};

NuisanceStep StepTo(const Dataset& data, const Nuisances& nuisances, const Linearisation& linear,
                    const Model& model, const NuisancePrior& prior) {
  std::vector<double> sizes = SizesOf(data, linear);
  const double middle_m = statistics::MedianOf(sizes);
  const double variance_m2 = VarianceOf(data, middle_m);
  NuisanceEquations equations(nuisances);
  for (const RowIndex row : data.row_indices()) {
    const LinearRow& at = linear.rows[row];
    const RowNumbers& numbers = data.numbers[row];
    if (numbers.count == 0) continue;
    if (SizeOf(numbers, at.residual) / MedianOfChi(numbers.count) > 4 * middle_m + 1e-9) continue;
    equations.Add(data, nuisances, at, row, 1 / variance_m2, at.residual);
  }
  equations.Add(nuisances.EquationsAt(model), 1);
  equations.H.diagonal() += prior.information;
  equations.g += prior.information.cwiseProduct(prior.offset);
  return {equations.H, equations.H.ldlt().solve(equations.g)};
}

/// Covariance of a session's frames, shape (9, 9); zero for frames that are not free.
Eigen::Matrix<double, 9, 9> FrameCovariance(const Nuisances& nuisances,
                                            const Eigen::MatrixXd& covariance,
                                            SessionIndex session) {
  Eigen::Matrix<double, 9, 9> of_session = Eigen::Matrix<double, 9, 9>::Zero();
  const int free = nuisances.per_session(), first = nuisances.FirstOf(session);
  const int place = nuisances.frames() ? 0 : 6;
  of_session.block(place, place, free, free) = covariance.block(first, first, free, free);
  return of_session;
}

}  // namespace

Result<Alignment> AlignFrames(const Dataset& data, const Model& given, int threads) {
  Alignment alignment{given, {}};
  alignment.covariance.assign(data.sessions.size(), Eigen::Matrix<double, 9, 9>::Zero());
  const Nuisances nuisances(data);
  if (nuisances.size() == 0) return alignment;
  Indexed<SessionIndex, FramePrior> priors;
  for (const Model::Frames& frames : given.frames) {
    priors.push_back(PriorOf(frames.tip_F, data.frames_free(), data.tip_free()));
  }
  Model& model = alignment.model;
  if (nuisances.of_sessions() > 0 && !data.ranges()) StartFrames(data, priors, model);
  if (const Result<void> started = StartPlaces(data, threads, model); !started) {
    return started.failure();
  }
  // Refined with the loaded arm and robust weights.
  const int passes = nuisances.size() > nuisances.of_sessions() ? 30 : 8;
  NuisanceStep last;
  for (int pass = 0; pass < passes; ++pass) {
    const Result<Linearisation> linear = Linearise(data, model, false, threads);
    if (!linear) return Error{linear.error()};
    last = StepTo(data, nuisances, *linear, model, PriorAt(nuisances, priors, model));
    if (!last.step.allFinite())
      return Error{
          "the rows do not determine the unknown frames: measure poses spread over the cell"};
    nuisances.Move(last.step, model);
    if (last.step.cwiseAbs().maxCoeff() < 1e-9) break;
  }
  const Eigen::MatrixXd covariance = last.information.inverse();
  for (const SessionIndex session : data.sessions.indices()) {
    alignment.covariance[session] = FrameCovariance(nuisances, covariance, session);
  }
  return alignment;
}

Result<Model> Align(const Dataset& data, const Model& given, int threads) {
  const Result<Alignment> alignment = AlignFrames(data, given, threads);
  if (!alignment) return Error{alignment.error()};
  return alignment->model;
}

std::optional<std::string> UndeterminedFramesText(const Dataset& data, const Alignment& alignment,
                                                  SessionIndex session) {
  // A posterior deviation above a fifth of the prior's: the rows add little along that direction.
  constexpr double kUndetermined_m = 0.01, kUndetermined_rad = 0.1;
  const Eigen::Matrix<double, 9, 9>& C = alignment.covariance[session];
  const Eigen::SelfAdjointEigenSolver<Mat3> tip(C.bottomRightCorner<3, 3>());
  const Eigen::SelfAdjointEigenSolver<Mat3> turn(C.block<3, 3>(3, 3));
  std::string directions;
  for (int k = 0; data.tip_free() && k < 3; ++k) {
    if (std::sqrt(std::max(0.0, tip.eigenvalues()[k])) < kUndetermined_m) continue;
    const Vec3 axis = tip.eigenvectors().col(k);
    directions += fmt::format("{}({:.2f}, {:.2f}, {:.2f})", directions.empty() ? "" : ", ",
                              axis.x(), axis.y(), axis.z());
  }
  std::string text;
  if (!directions.empty()) {
    text = fmt::format(
        "the rows do not determine the tip along {} in the flange frame, because the tool keeps "
        "its orientation: it stays as declared, assumed correct within 100 mm (95 %), and the "
        "radius of poses with another orientation increases by that. Measure a few poses with "
        "the tool turned by 30 deg or more",
        directions);
  }
  if (data.frames_free() && std::sqrt(std::max(0.0, turn.eigenvalues()[2])) > kUndetermined_rad) {
    text += fmt::format(
        "{}the rows do not determine the orientation of the robot base: measure poses spread over "
        "the cell",
        text.empty() ? "" : "; ");
  }
  if (text.empty()) return std::nullopt;
  return text;
}

}  // namespace plumbline::diagnosis
