#include "app/vision/camera/tag_fit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "firmware-like/geometry/rotation.h"

namespace plumbline::vision {
namespace {

constexpr int kMaxIterations = 25;
constexpr double kConverged = 1e-9;  ///< relative change of chi2

/// Derivative of the pixel with respect to the point in the camera frame [px/m].
Eigen::Matrix<double, 2, 3> PixelByPoint(const lens::Lens& lens, const Vec3& p) {
  const lens::Vec2 n = p.head<2>() / p.z();
  Eigen::Matrix<double, 2, 3> by_point;
  by_point << 1 / p.z(), 0, -n.x() / p.z(), 0, 1 / p.z(), -n.y() / p.z();
  return lens::PixelJacobian(lens, n) * by_point;
}

/// Residuals of all corners and their derivatives with respect to (translation, rotation, ln f).
struct Linearization {
  Eigen::VectorXd r;
  Eigen::MatrixXd J;
};

std::optional<Linearization> LinearizeAt(const lens::Lens& lens,
                                         const std::vector<TagObservation>& observations,
                                         const Pose& X) {
  const auto count = static_cast<Eigen::Index>(8 * observations.size());
  Linearization rows{Eigen::VectorXd(count), Eigen::MatrixXd(count, 7)};
  Eigen::Index row = 0;
  for (const TagObservation& observation : observations) {
    for (std::size_t k = 0; k < 4; ++k, row += 2) {
      const Vec3 turned = X.R * observation.p_K[k];
      const Vec3 p = turned + X.p;
      if (!(p.z() > 1e-6)) return std::nullopt;
      const lens::Vec2 pixel = Project<double>(lens, p);
      rows.r.segment<2>(row) = observation.pixels[k] - pixel;
      const Eigen::Matrix<double, 2, 3> by_point = PixelByPoint(lens, p);
      rows.J.block<2, 3>(row, 0) = by_point;
      rows.J.block<2, 3>(row, 3) = -by_point * CrossMatrix(turned);
      rows.J.block<2, 1>(row, 6) = pixel - lens::Vec2(lens.cx, lens.cy);
    }
  }
  if (!rows.r.allFinite() || !rows.J.allFinite()) return std::nullopt;
  return rows;
}

lens::Lens Scaled(lens::Lens lens, double log_focal) {
  lens.fx *= std::exp(log_focal);
  lens.fy *= std::exp(log_focal);
  return lens;
}

void AddCornerCovariance(const std::vector<TagObservation>& observations, double floor_px,
                         Eigen::MatrixXd& C) {
  C.diagonal().array() += floor_px * floor_px;
  Eigen::Index at = 0;
  for (const TagObservation& observation : observations) {
    C.block<8, 8>(at, at) += observation.covariance;
    at += 8;
  }
}

}  // namespace

std::vector<TagObservation> ObservedReferenceTags(const target::Body& cell,
                                                  const std::vector<SeenTag>& seen) {
  std::vector<TagObservation> observations;
  for (const target::BodyTag& declared : cell.tags) {
    const SeenTag* found = nullptr;
    int count = 0;
    for (const SeenTag& tag : seen) {
      if (tag.id == declared.id) found = &tag, ++count;
    }
    if (count != 1) continue;
    TagObservation observation{declared.id, CornersInTag(declared.side_m), found->corners_px,
                               found->covariance};
    for (Vec3& p : observation.p_K) p = declared.X_KM * p;
    observations.push_back(observation);
  }
  return observations;
}

TagFitProblem TagFitProblem::Without(std::size_t index) const {
  TagFitProblem remaining{observations, start, {}};
  remaining.observations.erase(remaining.observations.begin() + static_cast<std::ptrdiff_t>(index));
  std::vector<Eigen::Index> kept;
  const auto first = static_cast<Eigen::Index>(8 * index);
  for (Eigen::Index i = 0; i < covariance.rows(); ++i) {
    if (i < first || i >= first + 8) kept.push_back(i);
  }
  remaining.covariance = covariance(kept, kept);
  return remaining;
}

TagFitProblem ProblemAgainstBaseline(const target::Body& cell, const std::vector<SeenTag>& seen,
                                     const TagBaseline& baseline,
                                     const TagCheckSettings& settings) {
  TagFitProblem problem{{}, baseline.X_CK, {}};
  for (TagObservation observation : ObservedReferenceTags(cell, seen)) {
    const auto known = baseline.tags.find(observation.id);
    if (known == baseline.tags.end()) continue;
    for (std::size_t k = 0; k < 4; ++k) observation.pixels[k] -= known->second.residual_px[k];
    observation.covariance += known->second.covariance;
    problem.observations.push_back(observation);
  }
  const auto count = static_cast<Eigen::Index>(8 * problem.observations.size());
  problem.covariance = Eigen::MatrixXd::Zero(count, count);
  AddCornerCovariance(problem.observations, settings.corner_floor_px, problem.covariance);
  return problem;
}

std::optional<TagFitProblem> ProblemWithoutBaseline(const lens::KnownLens& lens,
                                                    const lens::LensCovariance& lens_covariance,
                                                    const target::Body& cell,
                                                    const std::vector<SeenTag>& seen,
                                                    const TagCheckSettings& settings) {
  const auto located = LocateBody(lens, cell, seen, std::nullopt);
  if (!located) return std::nullopt;
  TagFitProblem problem{ObservedReferenceTags(cell, seen), located->estimate.X_CK, {}};
  const auto rows = LinearizeAt(lens.lens, problem.observations, problem.start);
  if (!rows) return std::nullopt;
  const Eigen::Index count = rows->r.size();
  Eigen::MatrixXd by_lens(count, static_cast<Eigen::Index>(lens::kLensParameters));
  Eigen::MatrixXd& C = problem.covariance;
  C = Eigen::MatrixXd::Zero(count, count);
  Eigen::Index at = 0;
  for (const TagObservation& observation : problem.observations) {
    for (std::size_t k = 0; k < 4; ++k) {
      const Vec3 p = problem.start * observation.p_K[k];
      by_lens.middleRows<2>(at + 2 * static_cast<Eigen::Index>(k)) =
          lens::PixelByLens(lens.lens, p.head<2>() / p.z());
    }
    const auto by_place = rows->J.block<8, 3>(at, 0);
    C.block<8, 8>(at, at) +=
        settings.place_sd_m * settings.place_sd_m * by_place * by_place.transpose();
    at += 8;
  }
  AddCornerCovariance(problem.observations, settings.corner_floor_px, C);
  C += by_lens * lens_covariance * by_lens.transpose();
  return problem;
}

std::optional<TagFit> FitTags(const lens::Lens& lens, const TagFitProblem& problem,
                              const FreeParameters& free) {
  const Eigen::LLT<Eigen::MatrixXd> whitening(problem.covariance);
  if (whitening.info() != Eigen::Success || problem.observations.empty()) return std::nullopt;
  std::vector<Eigen::Index> columns;
  for (Eigen::Index c = 0; c < 7; ++c) {
    if (c < 6 ? free.pose : free.focal) columns.push_back(c);
  }
  TagFit fit;
  fit.X_CK = problem.start;
  fit.degrees_of_freedom = static_cast<int>(8 * problem.observations.size() - columns.size());
  double before = std::numeric_limits<double>::infinity();
  for (int step = 0; step < kMaxIterations; ++step) {
    const auto rows = LinearizeAt(Scaled(lens, fit.log_focal), problem.observations, fit.X_CK);
    if (!rows) return std::nullopt;
    const Eigen::VectorXd r = whitening.matrixL().solve(rows->r);
    fit.chi2 = r.squaredNorm();
    fit.rms_px = rows->r.norm() / std::sqrt(static_cast<double>(rows->r.size()));
    if (columns.empty()) return fit;
    const Eigen::MatrixXd J = whitening.matrixL().solve(rows->J(Eigen::all, columns));
    const Eigen::MatrixXd information = J.transpose() * J;
    const Eigen::LDLT<Eigen::MatrixXd> solved(information);
    const Eigen::VectorXd change = solved.solve(J.transpose() * r);
    if (!change.allFinite()) return std::nullopt;
    if (free.focal) {
      const auto last = information.rows() - 1;
      const Eigen::VectorXd unit = Eigen::VectorXd::Unit(information.rows(), last);
      fit.log_focal_sd = std::sqrt(std::max(0.0, solved.solve(unit)[last]));
    }
    if (std::abs(before - fit.chi2) <= kConverged * (1 + fit.chi2)) return fit;
    before = fit.chi2;
    if (free.pose) {
      fit.X_CK = {RotationFromVector(change.segment<3>(3)) * fit.X_CK.R,
                  fit.X_CK.p + change.head<3>()};
    }
    if (free.focal) fit.log_focal += change[change.size() - 1];
  }
  return std::nullopt;
}

}  // namespace plumbline::vision
