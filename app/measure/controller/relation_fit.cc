#include "app/measure/controller/relation_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "firmware-like/geometry/rotation.h"
#include "firmware-like/geometry/units.h"
#include "firmware-like/statistics/statistics.h"

namespace plumbline::measure {
namespace {

using Kind = RelationKind;

/// A controller computes with more digits than it shows; below these, agreement is not asked.
constexpr double kFloor_m = 1e-6, kFloorAngle = 2e-6;
/// Probability at which a right hypothesis is rejected.
constexpr double kRejected = 1e-5;
constexpr double kStep = 1e-6;  // of numerical derivatives, in prior standard deviations
constexpr int kIterations = 25, kScreeningIterations = 7;
constexpr int kAlternations = 10;     // of two frames, before the first iteration
constexpr int kHopelessAfter = 4;     // iterations of a screening
constexpr double kHopeless = 1e4;     // squared residual that remains then
constexpr std::size_t kScreened = 6;  // postures that a hypothesis is tried on first

double Variance(double step) {
  return step * step / 12;
}

/// Computes poses of one controller model.
class ModelPoses {
 public:
  ModelPoses(const RelationContext& context, const ControllerSample& sample, ControllerModel model)
      : context_(context), sample_(sample), model_(std::move(model)), chain_(model_.robot) {}

  const ControllerModel& model() const { return model_; }
  const kinematics::Chain& chain() const { return chain_; }

  model::JointVector JointsOf(const ControllerPosture& posture) const {
    model::JointVector q = posture.q;
    if (model_.lead_s != 0) q += model_.lead_s * posture.qd;
    if (!model_.order.empty()) {
      const model::JointVector read = q;
      for (std::size_t k = 0; k < model_.order.size(); ++k)
        q[model_.order[k]] = read[static_cast<int>(k)];
    }
    if (model_.joint_factor != 1) {
      for (int i = 0; i < q.size(); ++i) {
        if (chain_.type(i) == model::JointType::kRevolute) q[i] *= model_.joint_factor;
      }
    }
    return q;
  }

  /// The flange in the base.
  Pose Flange(const ControllerPosture& posture) const {
    model::JointVector q = JointsOf(posture);
    const loads::Payload payload = LoadOf(posture);
    if (model_.cell_deflection) {
      deflection::LoadedState state;
      effects::Conditions conditions;
      if (context_.arm.AtCommanded(q, payload, conditions, state))
        return state.X_BT * context_.arm.X_FT(posture.tool).Inverse();
    }
    kinematics::Posture at;
    if (model_.compliance.size() == q.size()) {
      const model::JointVector rigid = q;
      const Vec3 g_B = context_.cell.robot.X_WB.R.transpose() * context_.cell.robot.g_W;
      for (int pass = 0; pass < 2; ++pass) {
        chain_.Evaluate(q, at);
        model::JointVector tau;
        context_.arm.loads().Torques<double>(at, g_B, payload, tau);
        q = rigid + chain_.ReportedFromDrives<double>(model_.compliance.cwiseProduct(tau));
      }
    }
    chain_.Evaluate(q, at);
    return at.X_BF();
  }

  Pose Tool(const ControllerPosture& posture) const {
    return model_.X_FT ? *model_.X_FT : ToolOf(posture, context_);
  }
  Pose TipInReported(const ControllerPosture& posture, const Pose& X_BF) const {
    return model_.X_RB * X_BF * model_.X_FH * Tool(posture);
  }
  Pose TipInReported(const ControllerPosture& posture) const {
    return TipInReported(posture, Flange(posture));
  }

  /// The reported numbers read as this model has them.
  Pose Read(const Vec3& p_in, const Vec3& angles, const Mat3& R_in, const Pose& expected) const {
    Pose X;
    X.p = model_.length_factor * p_in;
    if (model_.mirrored_axis >= 0) X.p[model_.mirrored_axis] = -X.p[model_.mirrored_axis];
    X.R = RotationOf(angles, R_in, expected.R);
    if (model_.inverse_rotation) X.R.transposeInPlace();
    if (model_.inverse_pose) X = X.Inverse();
    return X;
  }

 private:
  Mat3 RotationOf(const Vec3& angles, const Mat3& R, const Mat3& expected) const {
    if (model_.scalar_last) {
      const Eigen::Quaterniond q(R);
      return Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y()).normalized().toRotationMatrix();
    }
    const bool as_stated = model_.convention < 0 && model_.angle_factor == 1;
    if (sample_.convention < 0 || as_stated) return R;
    const auto& conventions = AngleConventions();
    const int index = model_.convention < 0 ? sample_.convention : model_.convention;
    const AngleConvention& convention = conventions[static_cast<std::size_t>(index)];
    const Mat3 read = RotationFromNumbers(model_.angle_factor * angles, convention);
    // A rotation vector that came as a rotation has lost whole turns of its length.
    const double length = angles.norm();
    if (sample_.convention != kRotationVectorAngles || length < 1e-9) return read;
    const Vec3 other = angles * (1 - 2 * std::numbers::pi / length);
    const Mat3 turned = RotationFromNumbers(model_.angle_factor * other, convention);
    return (turned.transpose() * expected).trace() > (read.transpose() * expected).trace() ? turned
                                                                                           : read;
  }

  const RelationContext& context_;
  const ControllerSample& sample_;
  ControllerModel model_;
  kinematics::Chain chain_;
};

/// reported - predicted: position, and rotation vector in the frame of the reported poses.
Vec6 ErrorOf(const Pose& reported, const Pose& predicted) {
  Vec6 error;
  error << reported.p - predicted.p, VectorFromRotation(reported.R * predicted.R.transpose());
  return error;
}

/// Covariance of the error of a posture by the steps of its numbers.
Mat6 NoiseOf(const ModelPoses& poses, const ControllerSample& sample,
             const ControllerPosture& posture) {
  const Pose predicted = poses.TipInReported(posture);
  const Pose read = poses.Read(posture.p, posture.angles, posture.R, predicted);
  Mat6 noise = Mat6::Zero();
  noise.diagonal() << Vec3::Constant(kFloor_m * kFloor_m),
      Vec3::Constant(kFloorAngle * kFloorAngle);
  const auto add = [&](const Pose& moved, double variance, double step) {
    const Vec6 change = ErrorOf(moved, read) / step;
    noise += variance * change * change.transpose();
  };
  const bool as_numbers = sample.convention >= 0;
  for (int k = 0; k < 3; ++k) {
    constexpr double kSmall = 1e-6;
    const Vec3 p = posture.p + kSmall * Vec3::Unit(k);
    add(poses.Read(p, posture.angles, posture.R, predicted), Variance(sample.position_step),
        kSmall);
    const Vec3 angles = posture.angles + kSmall * Vec3::Unit(k);
    const Mat3 R =
        as_numbers ? RotationFromNumbers(
                         angles, AngleConventions()[static_cast<std::size_t>(sample.convention)])
                   : Mat3(RotationFromVector(kSmall * Vec3::Unit(k)) * posture.R);
    add(poses.Read(posture.p, angles, R, predicted), Variance(sample.angle_step), kSmall);
  }
  if (sample.joint_step > 0) {
    for (int i = 0; i < posture.q.size(); ++i) {
      constexpr double kSmall = 1e-6;
      ControllerPosture moved = posture;
      moved.q[i] += kSmall;
      const Vec6 change = ErrorOf(poses.TipInReported(moved), predicted) / kSmall;
      noise += Variance(sample.joint_step) * change * change.transpose();
    }
  }
  return noise;
}

/// The 24 rotations of a cube.
std::vector<Mat3> CubeRotations() {
  std::vector<Mat3> all;
  for (int x = 0; x < 3; ++x) {
    for (int y = 0; y < 3; ++y) {
      if (x == y) continue;
      for (const double sx : {1.0, -1.0}) {
        for (const double sy : {1.0, -1.0}) {
          const Vec3 ex = sx * Vec3::Unit(x), ey = sy * Vec3::Unit(y);
          Mat3& R = all.emplace_back();
          R << ex, ey, ex.cross(ey);
        }
      }
    }
  }
  return all;
}

}  // namespace

bool HypothesisFit::Accepted() const {
  return plausible && held_out_chi_square <= statistics::ChiSquareQuantile(kRejected, degrees);
}

/// A hypothesis with its parameters in units of their prior standard deviations.
struct RelationFitter::Prepared {
  Hypothesis hypothesis;
  std::vector<RelationParameters> parameters;
  Eigen::VectorXd prior_sd;
  int tool_at = -1, base_at = -1;       ///< first parameter of such a frame
  std::vector<Eigen::MatrixXd> whiten;  ///< of each posture: noise = L L^T, whiten = L^-1
};

RelationFitter::RelationFitter(const RelationContext& context, ControllerSample sample)
    : context_(context), sample_(std::move(sample)) {
  FindSteps(sample_);
  for (std::size_t k = 0; k < sample_.postures.size(); ++k) {
    all_.push_back(k);
    (k % 2 == 0 ? even_ : odd_).push_back(k);
    if (k % 2 == 0 && screened_.size() < kScreened) screened_.push_back(k);
  }
}

ControllerModel RelationFitter::ModelOf(const Hypothesis& hypothesis,
                                        const Eigen::VectorXd& values) const {
  ControllerModel model = NominalModel(context_);
  std::size_t at = 0;
  for (const Relation& relation : hypothesis) {
    const std::size_t count = ParametersOf(relation, context_, sample_).prior_sd.size();
    Apply(relation, std::span(values.data() + at, count), context_, sample_, model);
    at += count;
  }
  return model;
}

namespace {

ControllerModel ModelWith(const Hypothesis& hypothesis,
                          const std::vector<RelationParameters>& parameters,
                          const Eigen::VectorXd& values, const RelationContext& context,
                          const ControllerSample& sample) {
  ControllerModel model = NominalModel(context);
  std::size_t at = 0;
  for (std::size_t k = 0; k < hypothesis.size(); ++k) {
    const std::size_t count = parameters[k].prior_sd.size();
    Apply(hypothesis[k], std::span(values.data() + at, count), context, sample, model);
    at += count;
  }
  return model;
}

}  // namespace

RelationFitter::Prepared RelationFitter::Prepare(const Hypothesis& hypothesis) const {
  Prepared prepared;
  prepared.hypothesis = hypothesis;
  std::vector<double> prior;
  for (const Relation& relation : hypothesis) {
    const auto at = static_cast<int>(prior.size());
    if (relation.kind == Kind::kHiddenTool) prepared.tool_at = at;
    if (relation.kind == Kind::kBase) prepared.base_at = at;
    prepared.parameters.push_back(ParametersOf(relation, context_, sample_));
    const auto& sd = prepared.parameters.back().prior_sd;
    prior.insert(prior.end(), sd.begin(), sd.end());
  }
  prepared.prior_sd = Eigen::Map<Eigen::VectorXd>(prior.data(), std::ssize(prior));
  return prepared;
}

Eigen::VectorXd RelationFitter::Whitened(const Prepared& prepared, const Eigen::VectorXd& values,
                                         const Rows& rows) const {
  const ModelPoses poses(
      context_, sample_,
      ModelWith(prepared.hypothesis, prepared.parameters, values, context_, sample_));
  const int size = sample_.with_orientation ? 6 : 3;
  Eigen::VectorXd all(size * std::ssize(rows));
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const ControllerPosture& posture = sample_.postures[rows[k]];
    const Pose predicted = poses.TipInReported(posture);
    const Vec6 error =
        ErrorOf(poses.Read(posture.p, posture.angles, posture.R, predicted), predicted);
    all.segment(static_cast<int>(k) * size, size) = prepared.whiten[rows[k]] * error.head(size);
  }
  return all;
}

Eigen::MatrixXd RelationFitter::JacobianOf(const Prepared& prepared, const Eigen::VectorXd& values,
                                           const Rows& rows, const Eigen::VectorXd& at) const {
  Eigen::MatrixXd J(at.size(), values.size());
  for (int i = 0; i < values.size(); ++i) {
    if (prepared.prior_sd[i] <= kFixedValue) {
      J.col(i).setZero();
      continue;
    }
    Eigen::VectorXd moved = values;
    moved[i] += kStep * prepared.prior_sd[i];
    J.col(i) = (Whitened(prepared, moved, rows) - at) / kStep;
  }
  return J;
}

/// True if chance gives values as large as these, by the prior of each relation.
bool RelationFitter::Plausible(const Prepared& prepared, const Eigen::VectorXd& values) {
  int at = 0;
  for (const RelationParameters& parameters : prepared.parameters) {
    double chi_square = 0, free = 0;
    for (const double sd : parameters.prior_sd) {
      const double value = values[at++];
      if (sd <= kFixedValue) continue;
      chi_square += value * value / (sd * sd);
      ++free;
    }
    if (free > 0 && chi_square > statistics::ChiSquareQuantile(kRejected, free)) return false;
  }
  return true;
}

/// Values from which Newton's method starts: the best of the starts of all relations. A frame at
/// tool or base follows in closed form from the others.
Eigen::VectorXd RelationFitter::StartOf(Prepared& prepared, const Rows& rows) const {
  std::vector<Eigen::VectorXd> starts = {Eigen::VectorXd(0)};
  for (const RelationParameters& parameters : prepared.parameters) {
    if (parameters.prior_sd.empty()) continue;
    std::vector<Eigen::VectorXd> longer;
    for (const Eigen::VectorXd& start : starts) {
      for (const std::vector<double>& own : parameters.starts) {
        Eigen::VectorXd& both = longer.emplace_back(start.size() + std::ssize(own));
        both << start, Eigen::Map<const Eigen::VectorXd>(own.data(), std::ssize(own));
      }
    }
    starts = std::move(longer);
  }
  const bool with_frames = prepared.tool_at >= 0 || prepared.base_at >= 0;
  const std::vector<Mat3> turns = prepared.tool_at >= 0 && prepared.base_at >= 0
                                      ? CubeRotations()
                                      : std::vector<Mat3>{Mat3::Identity()};
  const auto set = [](Eigen::VectorXd& values, int at, const Pose& X) {
    values.segment<3>(at) = X.p;
    values.segment<3>(at + 3) = VectorFromRotation(X.R);
  };
  Eigen::VectorXd best = starts.front();
  double least = std::numeric_limits<double>::infinity();
  const double limit = 1e4;  // of each squared residual: a start that fits most postures is best
  for (const Eigen::VectorXd& start : starts) {
    for (const Mat3& turn : turns) {
      Eigen::VectorXd values = start;
      if (with_frames) {
        const ModelPoses poses(
            context_, sample_,
            ModelWith(prepared.hypothesis, prepared.parameters, values, context_, sample_));
        const ControllerModel& model = poses.model();
        Mat3 tools = Mat3::Zero(), bases = Mat3::Zero();
        Vec3 tool = Vec3::Zero(), reported_mean = Vec3::Zero(), tip_mean = Vec3::Zero();
        Mat3 spread = Mat3::Zero();
        std::vector<Mat3> flanges, reads, tips;
        for (const std::size_t row : rows) {
          const ControllerPosture& posture = sample_.postures[row];
          const Pose X_BF = poses.Flange(posture);
          const Pose predicted = poses.TipInReported(posture, X_BF);
          const Pose read = poses.Read(posture.p, posture.angles, posture.R, predicted);
          const Pose flange = model.X_RB * X_BF;
          const Pose X_FT = poses.Tool(posture);
          const Mat3 R_F = read.R * X_FT.R.transpose();
          tools += flange.R.transpose() * R_F;
          tool += flange.R.transpose() * (read.p - R_F * X_FT.p - flange.p);
          bases += read.R * (X_BF.R * turn * X_FT.R).transpose();
          flanges.push_back(X_BF.R);
          reads.push_back(read.R);
          tips.push_back(X_FT.R);
          reported_mean += read.p;
          tip_mean += predicted.p;
        }
        const double count = static_cast<double>(rows.size());
        Mat3 base = Mat3::Identity(), at_flange = turn;
        const bool both_turn = prepared.tool_at >= 0 && sample_.with_orientation;
        if (prepared.base_at >= 0) {
          if (!sample_.with_orientation) {
            for (const std::size_t row : rows) {
              const ControllerPosture& posture = sample_.postures[row];
              const Pose predicted = poses.TipInReported(posture);
              spread += (posture.p - reported_mean / count) *
                        (predicted.p - tip_mean / count).transpose();
            }
            bases = spread;
          }
          base = NearestRotation(bases);
          // With a frame at either end, each follows from the other in turn.
          for (int k = 0; k < kAlternations && both_turn; ++k) {
            Mat3 at_tool = Mat3::Zero(), at_base = Mat3::Zero();
            for (std::size_t i = 0; i < reads.size(); ++i)
              at_tool += (base * flanges[i]).transpose() * reads[i] * tips[i].transpose();
            at_flange = NearestRotation(at_tool);
            for (std::size_t i = 0; i < reads.size(); ++i)
              at_base += reads[i] * (flanges[i] * at_flange * tips[i]).transpose();
            base = NearestRotation(at_base);
          }
          set(values, prepared.base_at, {base, reported_mean / count - base * tip_mean / count});
        }
        if (prepared.tool_at >= 0) {
          const bool both = prepared.base_at >= 0;
          const Mat3 R = both                       ? at_flange
                         : sample_.with_orientation ? NearestRotation(tools)
                                                    : Mat3(Mat3::Identity());
          set(values, prepared.tool_at, {R, both ? Vec3(Vec3::Zero()) : Vec3(tool / count)});
        }
      }
      const Eigen::VectorXd residuals = Whitened(prepared, values, rows);
      const double cost = residuals.array().square().min(limit).sum() +
                          1e-6 * std::min(1e9, residuals.squaredNorm());
      if (cost < least) {
        least = cost;
        best = values;
      }
    }
  }
  return best;
}

void RelationFitter::FitRows(const Prepared& prepared, const Rows& rows,
                             const Eigen::VectorXd& start, HypothesisFit& fit,
                             bool screening) const {
  Eigen::VectorXd values = start;
  const auto count = values.size();
  Eigen::VectorXd residuals = Whitened(prepared, values, rows);
  const auto cost_of = [&](const Eigen::VectorXd& r, const Eigen::VectorXd& at) {
    return r.squaredNorm() + at.cwiseQuotient(prepared.prior_sd).squaredNorm();
  };
  double cost = cost_of(residuals, values), damping = 1e-6;
  Eigen::MatrixXd information = Eigen::MatrixXd::Identity(count, count);
  const int iterations = screening ? kScreeningIterations : kIterations;
  for (int iteration = 0; count > 0 && iteration < iterations; ++iteration) {
    if (screening && iteration == kHopelessAfter &&
        cost > kHopeless * static_cast<double>(residuals.size())) {
      break;
    }
    const Eigen::MatrixXd J = JacobianOf(prepared, values, rows, residuals);
    information = J.transpose() * J + Eigen::MatrixXd::Identity(count, count);
    const Eigen::VectorXd gradient =
        J.transpose() * residuals + values.cwiseQuotient(prepared.prior_sd);
    bool better = false;
    double before = cost;
    for (int attempt = 0; attempt < 8 && !better; ++attempt) {
      Eigen::MatrixXd damped = information;
      damped.diagonal() *= 1 + damping;
      const Eigen::VectorXd next =
          values - prepared.prior_sd.cwiseProduct(damped.ldlt().solve(gradient));
      const Eigen::VectorXd next_residuals = Whitened(prepared, next, rows);
      const double next_cost = cost_of(next_residuals, next);
      better = next_cost <= cost;
      damping = better ? std::max(1e-9, 0.1 * damping) : std::min(1e9, 20 * damping + 1e-4);
      if (!better) continue;
      values = next;
      residuals = next_residuals;
      cost = next_cost;
    }
    if (!better || before - cost < 1e-4 * (1 + 1e-4 * cost)) break;
  }
  fit.values = values;
  fit.chi_square = residuals.squaredNorm();
  fit.plausible = Plausible(prepared, values);
  if (count > 0 && !screening) {
    const Eigen::MatrixXd J = JacobianOf(prepared, values, rows, residuals);
    information = J.transpose() * J + Eigen::MatrixXd::Identity(count, count);
  }
  fit.covariance.resize(0, 0);
  fit.log_evidence = -0.5 * cost;
  if (count == 0) return;
  const Eigen::LDLT<Eigen::MatrixXd> factors(information);
  const double log_determinant = factors.vectorD().array().log().sum();
  const Eigen::MatrixXd inverse = factors.solve(Eigen::MatrixXd::Identity(count, count));
  fit.covariance = prepared.prior_sd.asDiagonal() * inverse * prepared.prior_sd.asDiagonal();
  fit.log_evidence = -0.5 * cost - 0.5 * log_determinant;
}

namespace {

std::vector<Eigen::MatrixXd> WhiteningOf(const RelationContext& context,
                                         const ControllerSample& sample,
                                         const ControllerModel& model) {
  const ModelPoses poses(context, sample, model);
  const int size = sample.with_orientation ? 6 : 3;
  std::vector<Eigen::MatrixXd> all;
  for (const ControllerPosture& posture : sample.postures) {
    const Eigen::MatrixXd noise = NoiseOf(poses, sample, posture).topLeftCorner(size, size);
    const Eigen::LLT<Eigen::MatrixXd> factors(noise);
    all.emplace_back(factors.matrixL().solve(Eigen::MatrixXd::Identity(size, size)));
  }
  return all;
}

}  // namespace

HypothesisFit RelationFitter::Fit(const Hypothesis& hypothesis, bool screening) const {
  const Rows& rows = screening ? screened_ : all_;
  Prepared prepared = Prepare(hypothesis);
  HypothesisFit fit;
  fit.hypothesis = hypothesis;
  Eigen::VectorXd zero = Eigen::VectorXd::Zero(prepared.prior_sd.size());
  prepared.whiten = WhiteningOf(
      context_, sample_, ModelWith(hypothesis, prepared.parameters, zero, context_, sample_));
  const Eigen::VectorXd start = StartOf(prepared, rows);
  // How a step of a joint moves the tool depends on what the relation makes of its reading.
  if (start.size() > 0) {
    prepared.whiten = WhiteningOf(
        context_, sample_, ModelWith(hypothesis, prepared.parameters, start, context_, sample_));
  }
  FitRows(prepared, rows, start, fit, screening);
  fit.degrees = static_cast<double>(std::ssize(rows) * (sample_.with_orientation ? 6 : 3));
  return fit;
}

void RelationFitter::Predict(HypothesisFit& fit) const {
  Prepared prepared = Prepare(fit.hypothesis);
  prepared.whiten = WhiteningOf(context_, sample_, ModelOf(fit.hypothesis, fit.values));
  const Eigen::VectorXd start = fit.values;
  FitRows(prepared, all_, start, fit);
  fit.held_out_chi_square = fit.degrees = 0;
  fit.held_out = {};
  for (const bool swap : {false, true}) {
    const Rows& known = swap ? odd_ : even_;
    const Rows& held_out = swap ? even_ : odd_;
    HypothesisFit half;
    FitRows(prepared, known, fit.values, half);
    const Eigen::VectorXd residuals = Whitened(prepared, half.values, held_out);
    Eigen::MatrixXd variance = Eigen::MatrixXd::Identity(residuals.size(), residuals.size());
    if (half.values.size() > 0) {
      const Eigen::MatrixXd J = JacobianOf(prepared, half.values, held_out, residuals) *
                                prepared.prior_sd.cwiseInverse().asDiagonal();
      variance += J * half.covariance * J.transpose();
    }
    fit.held_out_chi_square += residuals.dot(variance.ldlt().solve(residuals));
    fit.degrees += static_cast<double>(residuals.size());
    half.hypothesis = fit.hypothesis;
    const auto errors = Residuals(half);
    for (const std::size_t row : held_out) {
      const auto column = errors.col(static_cast<int>(row));
      fit.held_out.distance_m += column.head<3>().squaredNorm();
      fit.held_out.angle_rad += column.tail<3>().squaredNorm();
    }
  }
  const auto count = static_cast<double>(all_.size());
  fit.held_out.distance_m = std::sqrt(fit.held_out.distance_m / count);
  fit.held_out.angle_rad = std::sqrt(fit.held_out.angle_rad / count);
}

HypothesisFit RelationFitter::FitAndPredict(const Hypothesis& hypothesis) const {
  HypothesisFit fit = Fit(hypothesis);
  Predict(fit);
  return fit;
}

Pose RelationFitter::ReportedAt(const HypothesisFit& fit, const ControllerPosture& posture) const {
  const ModelPoses poses(context_, sample_, ModelOf(fit.hypothesis, fit.values));
  return poses.TipInReported(posture);
}

Eigen::Matrix<double, 6, Eigen::Dynamic> RelationFitter::Residuals(const HypothesisFit& fit) const {
  const ModelPoses poses(context_, sample_, ModelOf(fit.hypothesis, fit.values));
  Eigen::Matrix<double, 6, Eigen::Dynamic> all(6, std::ssize(sample_.postures));
  for (std::size_t k = 0; k < sample_.postures.size(); ++k) {
    const ControllerPosture& posture = sample_.postures[k];
    const Pose predicted = poses.TipInReported(posture);
    all.col(static_cast<int>(k)) =
        ErrorOf(poses.Read(posture.p, posture.angles, posture.R, predicted), predicted);
    if (!sample_.with_orientation) all.col(static_cast<int>(k)).tail<3>().setZero();
  }
  return all;
}

Eigen::VectorXd RelationFitter::WhitenedResiduals(const HypothesisFit& fit) const {
  Prepared prepared = Prepare(fit.hypothesis);
  prepared.whiten = WhiteningOf(context_, sample_, ModelOf(fit.hypothesis, fit.values));
  return Whitened(prepared, fit.values, all_);
}

double RelationFitter::Surprise(const HypothesisFit& fit, const ControllerPosture& posture) const {
  const int size = sample_.with_orientation ? 6 : 3;
  const ModelPoses poses(context_, sample_, ModelOf(fit.hypothesis, fit.values));
  const Pose predicted = poses.TipInReported(posture);
  const Vec6 error =
      ErrorOf(poses.Read(posture.p, posture.angles, posture.R, predicted), predicted);
  const Mat6 variance = NoiseOf(poses, sample_, posture) + PredictionVariance(fit, posture);
  return error.head(size).dot(variance.topLeftCorner(size, size).ldlt().solve(error.head(size)));
}

Mat6 RelationFitter::PredictionVariance(const HypothesisFit& fit,
                                        const ControllerPosture& posture) const {
  if (fit.values.size() == 0) return Mat6::Zero();
  const Eigen::VectorXd sd = fit.covariance.diagonal().cwiseMax(0).cwiseSqrt();
  const Pose centre = ReportedAt(fit, posture);
  Eigen::MatrixXd J(6, fit.values.size());
  for (int i = 0; i < fit.values.size(); ++i) {
    HypothesisFit moved = fit;
    const double step = std::max(1e-12, 1e-3 * sd[i]);
    moved.values[i] += step;
    J.col(i) = ErrorOf(ReportedAt(moved, posture), centre) / step;
  }
  return J * fit.covariance * J.transpose();
}

double RelationFitter::Separation(const HypothesisFit& a, const HypothesisFit& b,
                                  const ControllerPosture& posture) const {
  const int size = sample_.with_orientation ? 6 : 3;
  ControllerPosture at = posture;
  const Pose X = ReportedAt(a, posture);
  at.p = X.p;
  at.R = X.R;
  at.angles = VectorFromRotation(X.R);
  ControllerSample plain = sample_;
  plain.convention = kRotationVectorAngles;
  const ModelPoses plain_poses(context_, plain, NominalModel(context_));
  Mat6 variance = NoiseOf(plain_poses, plain, at);
  variance += PredictionVariance(a, posture) + PredictionVariance(b, posture);
  const Vec6 difference = ErrorOf(ReportedAt(b, posture), X);
  return difference.head(size).dot(
      variance.topLeftCorner(size, size).ldlt().solve(difference.head(size)));
}

}  // namespace plumbline::measure
