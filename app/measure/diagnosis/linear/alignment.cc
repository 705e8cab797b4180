#include "app/measure/diagnosis/linear/alignment.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <utility>

#include "app/measure/diagnosis/linear/fit_problem.h"
#include "app/measure/diagnosis/linear/frame_start.h"
#include "app/measure/diagnosis/linear/linearisation.h"
#include "app/measure/diagnosis/linear/nuisances.h"
#include "app/measure/diagnosis/linear/robust.h"
#include "firmware-like/geometry/rotation.h"
#include "firmware-like/statistics/statistics.h"

namespace plumbline::measure {
namespace {

// Initial positions of artefacts, from the predicted TCP at their rows.

/// The rows of one artefact: predicted TCPs in its frame, and readings [m].
struct ArtefactRows {
  std::vector<Vec3> touched, ranged;
  std::vector<double> readings, ranges;  ///< of gauges; of ranges
};

Vec3 MeanOf(const std::vector<Vec3>& points) {
  Vec3 sum = Vec3::Zero();
  for (const Vec3& p : points) sum += p;
  return points.empty() ? sum : Vec3(sum / static_cast<double>(points.size()));
}

/// Points less their mean, shape (points, 3).
Eigen::MatrixX3d Centred(const std::vector<Vec3>& points) {
  const Vec3 mean = MeanOf(points);
  Eigen::MatrixX3d rows(static_cast<Eigen::Index>(points.size()), 3);
  for (Eigen::Index k = 0; k < rows.rows(); ++k) {
    rows.row(k) = (points[k] - mean).transpose();
  }
  return rows;
}

/// Solves |p - c|^2 = r_k^2 + constant for the centre and the constant, linear in both.
/// @return  the centre, and the constant less |c|^2 about the mean point
std::pair<Vec3, double> CentreOf(const std::vector<Vec3>& points, const Eigen::VectorXd& squares) {
  const Eigen::MatrixX3d rows = Centred(points);
  Eigen::MatrixXd A(rows.rows(), 4);
  A << 2 * rows, Eigen::VectorXd::Ones(rows.rows());
  const Eigen::VectorXd right = rows.rowwise().squaredNorm() - squares;
  const Eigen::Vector4d x = A.completeOrthogonalDecomposition().solve(right);
  return {MeanOf(points) + x.head<3>(), x[3] + x.head<3>().squaredNorm()};
}

void StartPoint(const ArtefactRows& rows, PlacedArtefact& placed) {
  if (!rows.touched.empty()) {
    placed.place = MeanOf(rows.touched);
    return;
  }
  Eigen::VectorXd squares(static_cast<Eigen::Index>(rows.ranges.size()));
  for (Eigen::Index k = 0; k < squares.size(); ++k) {
    squares[k] = std::pow(rows.ranges[k], 2);
  }
  placed.place = CentreOf(rows.ranged, squares).first;
}

void StartSphere(const model::Artefact& declared, const ArtefactRows& rows,
                 PlacedArtefact& placed) {
  const auto count = static_cast<Eigen::Index>(rows.touched.size());
  const auto [centre, square] = CentreOf(rows.touched, Eigen::VectorXd::Zero(count));
  if (!declared.place) placed.place = centre;
  if (declared.radius_m) return;
  placed.radius_m = std::sqrt(std::max(square, 0.0));
  if (!declared.place) return;
  double sum = 0;
  for (const Vec3& p : rows.touched) sum += (p - placed.place).norm();
  placed.radius_m = sum / static_cast<double>(std::max<Eigen::Index>(1, count));
}

void StartPlane(const model::Artefact& declared, const ArtefactRows& rows, PlacedArtefact& placed) {
  if (!declared.direction && rows.touched.size() >= 3) {
    const Eigen::MatrixX3d points = Centred(rows.touched);
    const Eigen::SelfAdjointEigenSolver<Mat3> solver(Mat3(points.transpose() * points));
    placed.direction = solver.eigenvectors().col(0);
  }
  if (!declared.place) placed.place = MeanOf(rows.touched);
}

void StartGauge(const model::Artefact& declared, const ArtefactRows& rows, PlacedArtefact& placed) {
  const Eigen::Map<const Eigen::VectorXd> readings(rows.readings.data(),
                                                   static_cast<Eigen::Index>(rows.readings.size()));
  if (!declared.direction && rows.touched.size() >= 4) {
    const Eigen::VectorXd centred = readings.array() - readings.mean();
    const Vec3 slope = Centred(rows.touched).completeOrthogonalDecomposition().solve(centred);
    if (slope.norm() > 0) placed.direction = slope.normalized();
  }
  if (!declared.place) placed.place = MeanOf(rows.touched) - readings.mean() * placed.direction;
}

void StartArtefact(const model::Artefact& declared, const ArtefactRows& rows,
                   PlacedArtefact& placed) {
  switch (declared.kind) {
    case model::ArtefactKind::kPoint:
      if (!declared.place) StartPoint(rows, placed);
      break;
    case model::ArtefactKind::kSphere:
      StartSphere(declared, rows, placed);
      break;
    case model::ArtefactKind::kPlane:
      StartPlane(declared, rows, placed);
      break;
    case model::ArtefactKind::kGauge:
      StartGauge(declared, rows, placed);
      break;
  }
}

/// Sets the orientation of each tool in each session from its first measured pose there.
void StartOrientations(const Dataset& data, const Linearisation& linear, Model& model) {
  std::set<std::pair<SessionIndex, int>> done;
  for (const RowIndex row : data.row_indices()) {
    const SessionIndex session = data.session_of[row];
    const int tool = data.payloads[row].tool;
    if (data.observations[row].kind != ObservationKind::kPose) continue;
    if (!done.emplace(session, tool).second) continue;
    const LinearRow& at = linear.rows[row];
    const Mat3 R_WT = at.own.bottomRows<3>();
    Mat3& R_FT = model.frames[session].X_FT[tool].R;
    R_FT = R_FT * (R_WT.transpose() * RotationFromVector(at.residual.tail<3>()) * R_WT);
  }
}

/// Sets the constants that the cell does not declare, for every artefact that rows use:
///   point   the mean of the predicted TCPs, or by trilateration if only ranges were measured
///   sphere  |p|^2 = 2 c . p + (r^2 - |c|^2), linear in the unknowns
///   plane   the plane of least squares through them
///   gauge   the gradient of the readings
/// and the orientation of an unknown tool from the first measured pose of its session. Too few rows
/// leave what they do not determine at a placeholder.
/// @return  an error if a deflected posture does not converge
Result<void> StartPlaces(const Dataset& data, int threads, Model& model) {
  const auto& used = data.used_artefacts;
  const auto& turned = data.turned_sessions;
  const bool any_turned = std::ranges::find(turned, true) != turned.end();
  const bool any_used = std::ranges::find(used, true) != used.end();
  if (!any_used && !(any_turned && data.tip_free())) return {};
  const Result<Linearisation> linear = Linearise(data, model, false, threads);
  if (!linear) return Error{linear.error()};
  if (data.tip_free()) StartOrientations(data, *linear, model);
  Indexed<ArtefactIndex, ArtefactRows> rows(used.size());
  for (const RowIndex row : data.row_indices()) {
    const Observation& observation = data.observations[row];
    if (!OnArtefact(observation.kind)) continue;
    ArtefactRows& own = rows[observation.artefact];
    const bool in_base = data.cell.artefacts[observation.artefact.offset()].in_base;
    const Pose& X_WB = model.frames[data.session_of[row]].X_WB;
    const Vec3& p_W = linear->rows[row].p_W;
    const Vec3 p = in_base ? X_WB.Inverse() * p_W : p_W;
    if (observation.kind == ObservationKind::kArtefactRange) {
      own.ranged.push_back(p);
      own.ranges.push_back(*data.measured(row).range_m);
    } else {
      own.touched.push_back(p);
      own.readings.push_back(*data.measured(row).gauge_m);
    }
  }
  for (const ArtefactIndex artefact : used.indices()) {
    const ArtefactRows& own = rows[artefact];
    if (own.touched.empty() && own.ranged.empty()) continue;  // a subset of the rows may have none
    StartArtefact(data.cell.artefacts[artefact.offset()], own, model.artefacts[artefact]);
  }
  return {};
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
    const FramePrior& frames = priors[session];
    if (nuisances.frames())
      prior.information.segment<6>(nuisances.BaseOf(session)) = frames.base_information;
    for (int tool = 0; tool < static_cast<int>(frames.X_FT.size()); ++tool) {
      const auto at = nuisances.TipOf(session, tool);
      if (!at) continue;
      prior.information.segment<3>(*at).setConstant(frames.tip_information);
      prior.offset.segment<3>(*at) = frames.X_FT[tool].p - model.frames[session].X_FT[tool].p;
    }
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

FrameCovariance FrameCovarianceOf(const Nuisances& nuisances, const Eigen::MatrixXd& covariance,
                                  SessionIndex session, int tool) {
  std::vector<int> to, from;
  for (int k = 0; nuisances.frames() && k < 6; ++k) {
    to.push_back(k);
    from.push_back(nuisances.BaseOf(session) + k);
  }
  const auto tip = nuisances.TipOf(session, tool);
  for (int k = 0; tip && k < 3; ++k) {
    to.push_back(6 + k);
    from.push_back(*tip + k);
  }
  FrameCovariance of_tool = FrameCovariance::Zero();
  of_tool(to, to) = covariance(from, from);
  return of_tool;
}

/// The directions of the flange frame along which the rows do not determine a tip; empty if none.
std::string UndeterminedDirections(const FrameCovariance& covariance) {
  // A posterior deviation above a fifth of the prior's: the rows add little along that direction.
  constexpr double kUndetermined_m = 0.01;
  const Eigen::SelfAdjointEigenSolver<Mat3> tip(covariance.bottomRightCorner<3, 3>());
  std::string directions;
  for (int k = 0; k < 3; ++k) {
    if (std::sqrt(std::max(0.0, tip.eigenvalues()[k])) < kUndetermined_m) continue;
    const Vec3 axis = tip.eigenvectors().col(k);
    directions += fmt::format("{}({:.2f}, {:.2f}, {:.2f})", directions.empty() ? "" : ", ",
                              axis.x(), axis.y(), axis.z());
  }
  return directions;
}

}  // namespace

Result<Alignment> AlignFrames(const Dataset& data, const Model& given, int threads) {
  Alignment alignment{given, {}};
  const int tools = data.cell.tools();
  alignment.covariance.assign(
      data.sessions.size(),
      std::vector<FrameCovariance>(static_cast<std::size_t>(tools), FrameCovariance::Zero()));
  const Nuisances nuisances(data);
  if (nuisances.size() == 0) return alignment;
  Indexed<SessionIndex, FramePrior> priors;
  for (const Model::Frames& frames : given.frames) {
    priors.push_back(FramePriorOf(frames.X_FT, data.frames_free(), data.tip_free()));
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
    for (int tool = 0; tool < tools; ++tool) {
      alignment.covariance[session][tool] = FrameCovarianceOf(nuisances, covariance, session, tool);
    }
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
  constexpr double kUndetermined_rad = 0.1;  // a fifth of the prior's deviation, as for a tip
  const std::vector<FrameCovariance>& covariance = alignment.covariance[session];
  const Eigen::SelfAdjointEigenSolver<Mat3> turn(covariance.front().block<3, 3>(3, 3));
  std::string text;
  for (int tool = 0; data.tip_free() && tool < data.cell.tools(); ++tool) {
    if (!data.measured_tools[session][tool]) continue;
    const std::string directions = UndeterminedDirections(covariance[tool]);
    if (directions.empty()) continue;
    const std::optional<int> number = data.cell.ToolAt(tool).number;
    text += fmt::format(
        "{}the rows do not determine the tip{} along {} in the flange frame, because the tool "
        "keeps its orientation: it stays as declared, assumed correct within 100 mm (95 %), and "
        "the radius of poses with another orientation increases by that. Measure a few poses with "
        "the tool turned by 30 deg or more",
        text.empty() ? "" : "; ",
        data.cell.tools() > 1 && number ? fmt::format(" of tool {}", *number) : "", directions);
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

}  // namespace plumbline::measure
