#include "app/vision/hand_eye/hand_eye_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "firmware-like/geometry/rotation.h"
#include "firmware-like/statistics/group_equations.h"

namespace plumbline::vision {
namespace {

using SharedColumn = Eigen::Matrix<double, kHandEyeShared, 1>;
constexpr double kHuber = 3;  // threshold, in standard deviations of a corner
constexpr int kMaxSteps = 60;
constexpr double kMinDistance_m = 1e-3;

/// Normal equations at one state: shared parameters, and the six of each view.
struct NormalEquations {
  HandEyeMatrix S = HandEyeMatrix::Zero();
  SharedColumn g = SharedColumn::Zero();
  struct View : statistics::GroupEquations<6, kHandEyeShared> {
    double squares_px = 0, weighted_px = 0;
    int corners = 0;
  };
  std::vector<View> views;
  double cost = 0;
  bool in_front = true;
};

/// Derivative of the flange pose with respect to each joint, in F: position, then rotation.
kinematics::Jacobian JointMotion(const kinematics::Chain& chain, const model::JointVector& q) {
  kinematics::Posture posture;
  chain.Evaluate(q, posture);
  kinematics::Jacobian jacobian;
  chain.JacobianAt(posture, posture.X_BF().p, jacobian);
  const Mat3 R_FB = posture.X_BF().R.transpose();
  jacobian.topRows<3>() = (R_FB * jacobian.topRows<3>()).eval();
  jacobian.bottomRows<3>() = (R_FB * jacobian.bottomRows<3>()).eval();
  return jacobian;
}

/// One point in C, and its derivatives with respect to the shared parameters and the view's own.
struct PointDerivatives {
  Vec3 p_C;
  Eigen::Matrix<double, 3, kHandEyeShared> shared;
  Eigen::Matrix<double, 3, 6> own;
};

void DerivativesAt(const HandEyeOptions& options, const HandEyeState& state, const Pose& X_BF,
                   const kinematics::Jacobian* joints, const Pose& E, const Vec3& p_K,
                   PointDerivatives& derivatives) {
  const Pose& Y = state.poses.Y;
  const Pose& X = state.poses.X;
  const Vec3 p = state.size * p_K, p_X = X * p;
  const Mat3 to_C = Y.R.transpose();
  Mat3 from_X;  // d p_B / d p_X, with p_B the point in Y's parent frame
  Vec3 p_B;
  derivatives.shared.setZero();
  if (options.setup == HandEyeSetup::kEyeToHand) {
    const Vec3 p_E = E * p_X;
    p_B = X_BF * p_E;
    from_X = X_BF.R * E.R;
    derivatives.own.leftCols<3>() = to_C * X_BF.R;
    derivatives.own.rightCols<3>() = -to_C * from_X * CrossMatrix(p_X);
    for (int i = 0; joints != nullptr && i < joints->cols(); ++i) {
      const Vec3 turn = joints->col(i).tail<3>();
      derivatives.shared.col(kOffsetFirst + i) =
          to_C * X_BF.R * (joints->col(i).head<3>() + turn.cross(p_E));
    }
  } else {
    const Pose A = X_BF.Inverse();
    const Vec3 p_A = A * p_X;
    p_B = E * p_A;
    from_X = E.R * A.R;
    derivatives.own.leftCols<3>() = to_C;
    derivatives.own.rightCols<3>() = -to_C * E.R * CrossMatrix(p_A);
    for (int i = 0; joints != nullptr && i < joints->cols(); ++i) {
      const Vec3 turn = joints->col(i).tail<3>();
      derivatives.shared.col(kOffsetFirst + i) =
          -to_C * E.R * (joints->col(i).head<3>() + turn.cross(p_A));
    }
  }
  derivatives.p_C = to_C * (p_B - Y.p);
  derivatives.shared.middleCols<3>(kCameraPosition) = -to_C;
  derivatives.shared.middleCols<3>(kCameraRotation) = CrossMatrix(derivatives.p_C);
  derivatives.shared.middleCols<3>(kTargetPosition) = to_C * from_X;
  derivatives.shared.middleCols<3>(kTargetRotation) = -to_C * from_X * X.R * CrossMatrix(p);
  derivatives.shared.col(kTargetSize) = to_C * from_X * X.R * p_K;
}

SharedColumn DeviationFromPrior(const HandEyePrior& prior, const HandEyeState& state) {
  SharedColumn off = SharedColumn::Zero();
  const lens::Lens &a = state.lens, &b = prior.lens;
  off[kTargetSize] = state.size - 1;
  off.segment<9>(kLensFirst) << a.fx - b.fx, a.fy - b.fy, a.cx - b.cx, a.cy - b.cy, a.k1 - b.k1,
      a.k2 - b.k2, a.p1 - b.p1, a.p2 - b.p2, a.k3 - b.k3;
  off.segment(kOffsetFirst, state.offsets.size()) = state.offsets;
  return off;
}

NormalEquations NormalAt(const std::vector<HandEyeView>& views, const HandEyeOptions& options,
                         const HandEyePrior& prior, const HandEyeNoise& noise,
                         const HandEyeState& state) {
  NormalEquations normal;
  const SharedColumn off = DeviationFromPrior(prior, state);
  normal.S = prior.information;
  normal.g = prior.information * off;
  normal.cost = off.dot(normal.g);
  normal.views.resize(views.size());
  Vec6 robot_information;
  robot_information << Vec3::Constant(1 / (noise.robot_m * noise.robot_m)),
      Vec3::Constant(1 / (noise.robot_rad * noise.robot_rad));
  for (std::size_t k = 0; k < views.size(); ++k) {
    const HandEyeView& view = views[k];
    NormalEquations::View& own = normal.views[k];
    const Pose& E = state.errors[k];
    Vec6 error;
    error << E.p, VectorFromRotation(E.R);
    own.A = robot_information.asDiagonal();
    own.B.setZero();
    own.a = robot_information.cwiseProduct(error);
    normal.cost += error.dot(own.a);
    const Pose X_BF = FlangePose(options, view, state.offsets);
    kinematics::Jacobian joints;
    const bool moved = options.free_joints && state.offsets.size() > 0;
    if (moved) joints = JointMotion(*options.chain, view.q + state.offsets);
    PointDerivatives derivatives;
    for (std::size_t i = 0; i < view.pixels.size(); ++i) {
      DerivativesAt(options, state, X_BF, moved ? &joints : nullptr, E, view.points_K[i],
                    derivatives);
      const Vec3& p = derivatives.p_C;
      if (!(p.z() > kMinDistance_m)) {
        normal.in_front = false;
        return normal;
      }
      const lens::Vec2 n(p.x() / p.z(), p.y() / p.z());
      Eigen::Matrix<double, 2, 3> d_point;
      const Eigen::Matrix2d d_n = lens::PixelJacobian(state.lens, n);
      d_point << d_n / p.z(), -d_n * n / p.z();
      Eigen::Matrix<double, 2, kHandEyeShared> J = d_point * derivatives.shared;
      J.middleCols<9>(kLensFirst) = lens::PixelByLens(state.lens, n).leftCols<9>();
      const Eigen::Matrix<double, 2, 6> J_own = d_point * derivatives.own;
      const lens::Vec2 r = lens::PixelOfNormalised<double>(state.lens, n) - view.pixels[i];
      const double length = r.norm() / noise.corner_px;
      const double weight = length > kHuber ? kHuber / length : 1;
      normal.cost += length > kHuber ? kHuber * (2 * length - kHuber) : length * length;
      const double w = weight / (noise.corner_px * noise.corner_px);
      normal.S.noalias() += w * J.transpose() * J;
      normal.g.noalias() += w * J.transpose() * r;
      own.A.noalias() += w * J_own.transpose() * J_own;
      own.B.noalias() += w * J_own.transpose() * J;
      own.a.noalias() += w * J_own.transpose() * r;
      own.squares_px += r.squaredNorm();
      own.weighted_px += weight * r.squaredNorm();
      ++own.corners;
    }
  }
  return normal;
}

/// Replaces rows and columns of inactive parameters by those of the identity.
void Deactivate(const HandEyePrior& prior, HandEyeMatrix& S, SharedColumn& g) {
  for (int i = 0; i < kHandEyeShared; ++i) {
    if (prior.active[i]) continue;
    S.row(i).setZero();
    S.col(i).setZero();
    S(i, i) = 1;
    g[i] = 0;
  }
}

using Factors = std::vector<NormalEquations::View::Factor>;

/// The shared part after elimination of the views' own parameters.
Factors Reduce(const NormalEquations& normal, const HandEyePrior& prior, double damping,
               HandEyeMatrix& S, SharedColumn& g) {
  S = normal.S;
  S.diagonal() *= 1 + damping;
  g = normal.g;
  Factors factors;
  for (const NormalEquations::View& view : normal.views)
    factors.push_back(view.Eliminate(S, g, damping));
  Deactivate(prior, S, g);
  return factors;
}

HandEyeState ApplyStep(const HandEyeState& state, const NormalEquations& normal,
                       const Factors& factors, const SharedColumn& step) {
  HandEyeState next = state;
  next.poses.Y.p += step.segment<3>(kCameraPosition);
  next.poses.Y.R = state.poses.Y.R * RotationFromVector(step.segment<3>(kCameraRotation));
  next.poses.X.p += step.segment<3>(kTargetPosition);
  next.poses.X.R = state.poses.X.R * RotationFromVector(step.segment<3>(kTargetRotation));
  next.size += step[kTargetSize];
  double* const lens[] = {&next.lens.fx, &next.lens.fy, &next.lens.cx, &next.lens.cy, &next.lens.k1,
                          &next.lens.k2, &next.lens.p1, &next.lens.p2, &next.lens.k3};
  for (int i = 0; i < 9; ++i) *lens[i] += step[kLensFirst + i];
  next.offsets += step.segment(kOffsetFirst, next.offsets.size());
  for (std::size_t k = 0; k < next.errors.size(); ++k) {
    const Vec6 by = normal.views[k].Step(factors[k], step);
    next.errors[k].p += by.head<3>();
    next.errors[k].R = state.errors[k].R * RotationFromVector(by.tail<3>());
  }
  return next;
}

/// Computes covariance, variance components, and the misfit of each view.
void Evaluate(const NormalEquations& normal, const HandEyePrior& prior, const HandEyeNoise& noise,
              const HandEyeState& state, HandEyeFit& fit) {
  HandEyeMatrix S;
  SharedColumn g;
  const Factors factors = Reduce(normal, prior, 0, S, g);
  fit.covariance = S.ldlt().solve(HandEyeMatrix::Identity());
  double position_squares = 0, rotation_squares = 0, position_redundancy = 0,
         rotation_redundancy = 0, corner_squares = 0;
  double all_px = 0, corners = 0;
  for (std::size_t k = 0; k < normal.views.size(); ++k) {
    const NormalEquations::View& own = normal.views[k];
    const Eigen::Matrix<double, 6, kHandEyeShared> through = factors[k].solve(own.B);
    HandEyeMatrix shared = fit.covariance;
    for (int i = 0; i < kHandEyeShared; ++i) {
      if (!prior.active[i]) shared(i, i) = 0;
    }
    const Mat6 covariance =
        factors[k].solve(Mat6::Identity()) + through * shared * through.transpose();
    for (int axis = 0; axis < 3; ++axis) {
      position_redundancy += 1 - covariance(axis, axis) / (noise.robot_m * noise.robot_m);
      rotation_redundancy +=
          1 - covariance(3 + axis, 3 + axis) / (noise.robot_rad * noise.robot_rad);
    }
    const double place = state.errors[k].p.squaredNorm();
    const double turn = VectorFromRotation(state.errors[k].R).squaredNorm();
    position_squares += place;
    rotation_squares += turn;
    fit.position_misfit.push_back(std::sqrt(place / 3) / noise.robot_m);
    fit.rotation_misfit.push_back(std::sqrt(turn / 3) / noise.robot_rad);
    fit.view_rms_px.push_back(std::sqrt(own.squares_px / std::max(1, own.corners)));
    corner_squares += own.weighted_px;
    all_px += own.squares_px;
    corners += own.corners;
  }
  double active = 0, known = 0, prior_redundancy = 0;
  for (int i = 0; i < kHandEyeShared; ++i) {
    if (!prior.active[i]) continue;
    ++active;
    if (prior.information(i, i) <= 0) continue;
    ++known;
    prior_redundancy += std::clamp(1 - fit.covariance(i, i) * prior.information(i, i), 0.0, 1.0);
  }
  const double corner_redundancy =
      2 * corners + known - active - position_redundancy - rotation_redundancy - prior_redundancy;
  constexpr double kMinPx = 0.005, kMinPosition_m = 5e-6, kMinRedundancy = 0.5;
  fit.rms_px = std::sqrt(all_px / std::max(1.0, corners));
  fit.noise.corner_px =
      std::max(kMinPx, std::sqrt(corner_squares / std::max(kMinRedundancy, corner_redundancy)));
  // Position and rotation share one component: see HandEyeNoise.
  const double lever2 = kRotationLever_m * kRotationLever_m;
  const double free = std::max(kMinRedundancy, position_redundancy + rotation_redundancy);
  fit.noise.robot_m =
      std::max(kMinPosition_m, std::sqrt((position_squares + lever2 * rotation_squares) / free));
  fit.noise.robot_rad = fit.noise.robot_m / kRotationLever_m;
}

}  // namespace

Pose ChainPose(const HandEyeOptions& options, const HandEyePoses& poses, const Pose& X_BF,
               const Pose& E) {
  if (options.setup == HandEyeSetup::kEyeToHand) return poses.Y.Inverse() * X_BF * E * poses.X;
  return poses.Y.Inverse() * E * X_BF.Inverse() * poses.X;
}

Pose FlangePose(const HandEyeOptions& options, const HandEyeView& view,
                const model::JointVector& offsets) {
  if (options.chain == nullptr || view.q.size() == 0) return view.X_BF;
  kinematics::Posture posture;
  options.chain->Evaluate(offsets.size() > 0 ? model::JointVector(view.q + offsets) : view.q,
                          posture);
  return posture.X_BF();
}

HandEyeFit FitHandEye(const std::vector<HandEyeView>& views, const HandEyeOptions& options,
                      const HandEyePrior& prior, const HandEyeNoise& noise, HandEyeState& state) {
  constexpr double kSettled = 1e-9;     // relative decrease of the cost
  constexpr double kNegligible = 1e-9;  // cost at rounding level
  HandEyeFit fit;
  state.errors.resize(views.size());
  NormalEquations normal = NormalAt(views, options, prior, noise, state);
  if (!normal.in_front) return fit;
  double damping = 1e-4;
  for (int pass = 0; pass < kMaxSteps && !fit.converged; ++pass) {
    HandEyeMatrix S;
    SharedColumn g;
    const Factors factors = Reduce(normal, prior, damping, S, g);
    const SharedColumn step = S.ldlt().solve(-g);
    HandEyeState next = ApplyStep(state, normal, factors, step);
    NormalEquations there = NormalAt(views, options, prior, noise, next);
    if (step.allFinite() && there.in_front && there.cost <= normal.cost + kNegligible) {
      fit.converged =
          normal.cost - there.cost <= kSettled * normal.cost || there.cost < kNegligible;
      state = std::move(next);
      normal = std::move(there);
      damping = std::max(1e-12, damping / 10);
    } else {
      damping *= 10;
      // No step improves the cost: converged to numerical precision.
      fit.converged = damping > 1e8;
    }
  }
  fit.cost = normal.cost;
  Evaluate(normal, prior, noise, state, fit);
  return fit;
}

}  // namespace plumbline::vision
