#include "app/vision/camera/next_view.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "app/vision/lens/lens_fit.h"
#include "app/vision/lens/projection_uncertainty.h"
#include "firmware-like/geometry/rotation.h"
#include "firmware-like/statistics/group_equations.h"

namespace plumbline::vision {
namespace {

// Before the first fit: a lens of a usual angle of view.
constexpr double kUsualFocalShare = 1.2;    ///< of the image's width
constexpr double kFocalLogDeviation = 0.7;  ///< between a wide and a long lens
constexpr double kUsualSigma_px = 0.1;
constexpr std::size_t kMinViewsForFit = 3;

/// Prior of the lens fit, and of the focal length.
SharedMatrix Prior(const target::Board& board, image::ImageSize size, double f) {
  SharedMatrix information = PriorInformation({}, board, size, f);
  information(kFy, kFy) += 1 / std::pow(kFocalLogDeviation * f, 2);
  return information;
}

}  // namespace

LensKnowledge KnowledgeFrom(const target::Board& board, std::span<const BoardView> views,
                            image::ImageSize size) {
  LensKnowledge knowledge;
  if (views.size() >= kMinViewsForFit) {
    if (const auto fit = FitLens(board, views, size)) {
      knowledge.shared = fit->shared;
      knowledge.sigma_px = fit->sigma_px;
      knowledge.information = Prior(board, size, fit->shared[kFx]);
      for (const ViewInformation& view : fit->view_information)
        knowledge.information += view.information;
      return knowledge;
    }
  }
  lens::Lens lens;
  lens.fx = lens.fy = kUsualFocalShare * size.width;
  lens.cx = 0.5 * (size.width - 1);
  lens.cy = 0.5 * (size.height - 1);
  knowledge.shared = SharedOfLens(lens);
  knowledge.sigma_px = kUsualSigma_px;
  knowledge.information = Prior(board, size, lens.fx);
  for (const BoardView& view : views) {
    const std::vector<Pose> poses = BoardPoses(board, view, lens);
    if (poses.empty()) continue;
    if (const auto information =
            InformationOfView(board, knowledge.shared, poses.front(), knowledge.sigma_px))
      knowledge.information += *information;
  }
  return knowledge;
}

std::optional<SharedMatrix> InformationOfView(const target::Board& board,
                                              const SharedVector& shared, const Pose& X_CK,
                                              double sigma_px) {
  const Eigen::Index n = board.corners();
  std::vector<lens::Vec2> pixels;
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  Rows S(2 * n, static_cast<Eigen::Index>(kSharedCount)), P(2 * n, 6);
  if (!BoardPixels(board, shared, X_CK.R, Vec3::Zero(), X_CK.p, pixels, S.data(), P.data()))
    return std::nullopt;
  const statistics::GroupEquations<6, kSharedCount> own{P.transpose() * P, P.transpose() * S,
                                                        Vec6::Zero()};
  SharedMatrix information = S.transpose() * S;
  SharedVector unused = SharedVector::Zero();
  own.Eliminate(information, unused);
  if (!information.allFinite()) return std::nullopt;
  return SharedMatrix(information / (sigma_px * sigma_px));
}

namespace {

constexpr double kTilts_rad[] = {0.3, 0.55};
constexpr int kTiltDirections = 8;
constexpr double kShares[] = {0.4, 0.6, 0.9};  ///< of the image's width or height that is filled
constexpr int kEdgeParts = 4;                  ///< segments of each edge of an outline
constexpr double kMargin = 0.01;               ///< beside the outline, share of the image's width
constexpr int kShrinkSteps = 8;

/// The pose with this rotation whose centre lies at a pixel and a distance.
Pose PoseAt(const target::Board& board, const lens::Lens& lens, const Mat3& R,
            const lens::Vec2& pixel, double z_m) {
  const lens::Vec2 centre = board.Centre();
  const Vec3 centre_C((pixel.x() - lens.cx) / lens.fx * z_m, (pixel.y() - lens.cy) / lens.fy * z_m,
                      z_m);
  return {R, centre_C - R * Vec3(centre.x(), centre.y(), 0)};
}

bool IsInside(const std::vector<lens::Vec2>& outline, image::ImageSize size) {
  const double margin = kMargin * size.width;
  return std::ranges::all_of(outline, [&](const lens::Vec2& p) {
    return p.x() >= margin && p.y() >= margin && p.x() < size.width - margin &&
           p.y() < size.height - margin;
  });
}

}  // namespace

std::vector<lens::Vec2> OutlineOf(const target::Board& board, const lens::Lens& lens,
                                  const Pose& X_CK) {
  const lens::Vec2 margin = lens::Vec2::Constant(board.square_m);
  const lens::Vec2 first = -margin, last = 2 * board.Centre() + margin;
  const std::array<lens::Vec2, 5> corners = {first, lens::Vec2(last.x(), first.y()), last,
                                             lens::Vec2(first.x(), last.y()), first};
  std::vector<lens::Vec2> outline;
  for (int edge = 0; edge < 4; ++edge) {
    for (int part = edge == 0 ? 0 : 1; part <= kEdgeParts; ++part) {
      const double share = static_cast<double>(part) / kEdgeParts;
      const lens::Vec2 xy = (1 - share) * corners[edge] + share * corners[edge + 1];
      const Vec3 p_C = X_CK * Vec3(xy.x(), xy.y(), 0);
      outline.push_back(p_C.z() > 0 ? lens::Vec2(Project(lens, p_C))
                                    : lens::Vec2::Constant(-INFINITY));
    }
  }
  return outline;
}

std::vector<Pose> CandidatePoses(const target::Board& board, const lens::Lens& lens,
                                 image::ImageSize size) {
  const lens::Vec2 middle = lens::MiddleOf(size);
  const lens::Vec2 extent = 2 * board.Centre() + lens::Vec2::Constant(2 * board.square_m);
  std::vector<Pose> poses;
  for (const double share : kShares) {
    const double z_m = std::max(lens.fx * extent.x() / (share * size.width),
                                lens.fy * extent.y() / (share * size.height));
    for (const double tilt_rad : kTilts_rad) {
      for (int direction = 0; direction < kTiltDirections; ++direction) {
        const double angle = 2 * std::numbers::pi * direction / kTiltDirections;
        const Mat3 R = RotationFromVector(tilt_rad * Vec3(std::cos(angle), std::sin(angle), 0));
        for (const double right : {-1, 0, 1}) {
          for (const double down : {-1, 0, 1}) {
            // As far from the middle as the board stays inside the image.
            for (int step = kShrinkSteps; step >= 0; --step) {
              const double reach = 0.5 * step / kShrinkSteps;
              const Pose X_CK =
                  PoseAt(board, lens, R,
                         middle + reach * lens::Vec2(right * size.width, down * size.height), z_m);
              if (!IsInside(OutlineOf(board, lens, X_CK), size)) continue;
              if (step > 0 || (right == 0 && down == 0)) poses.push_back(X_CK);
              break;
            }
          }
        }
      }
    }
  }
  return poses;
}

namespace {

// A candidate elsewhere, or held otherwise.
constexpr double kElsewhere = 0.15;  ///< share of the image's width
constexpr double kOtherwise_rad = 0.4;

}  // namespace

NextViewChoice::NextViewChoice(const target::Board& board, LensKnowledge knowledge,
                               image::ImageSize size, std::optional<double> distance_m)
    : board_(board),
      knowledge_(std::move(knowledge)),
      size_(size),
      distance_m_(distance_m),
      weight_(ProjectionWeight(lens(), size, distance_m).topLeftCorner<kLensCount, kLensCount>()),
      variance_(MeanVariance(knowledge_.information)) {
  for (const Pose& X_CK : CandidatePoses(board, lens(), size)) {
    const auto information = InformationOfView(board, knowledge_.shared, X_CK, knowledge_.sigma_px);
    if (!information) continue;
    candidates_.push_back(
        {X_CK, *information,
         std::log(variance_ / MeanVariance(knowledge_.information + *information))});
    if (candidates_.back().gain > candidates_[best_].gain) best_ = candidates_.size() - 1;
  }
}

double NextViewChoice::MeanVariance(const SharedMatrix& information) const {
  return weight_.cwiseProduct(information.inverse().topLeftCorner<kLensCount, kLensCount>()).sum();
}

double NextViewChoice::GainAt(const Pose& X_CK) const {
  const auto information = InformationOfView(board_, knowledge_.shared, X_CK, knowledge_.sigma_px);
  if (!information) return -1;
  return std::log(variance_ / MeanVariance(knowledge_.information + *information));
}

std::optional<Pose> NextViewChoice::SeenAt(const BoardView& view) const {
  const std::vector<Pose> poses = BoardPoses(board_, view, lens());
  if (poses.empty()) return std::nullopt;
  return poses.front();
}

void NextViewChoice::ChooseAnother() {
  const Pose left = X_CK();
  const auto centre_px = [&](const Pose& X) {
    return Project(lens(), X * Vec3(board_.Centre().x(), board_.Centre().y(), 0));
  };
  const auto is_alike = [&](const Candidate& other) {
    return (centre_px(other.X_CK) - centre_px(left)).norm() < kElsewhere * size_.width &&
           VectorFromRotation(other.X_CK.R * left.R.transpose()).norm() < kOtherwise_rad;
  };
  best_ = 0;
  for (std::size_t k = 0; k < candidates_.size(); ++k) {
    if (is_alike(candidates_[k])) candidates_[k].gain = 0;
    if (candidates_[k].gain > candidates_[best_].gain) best_ = k;
  }
}

int NextViewChoice::ViewsUntil(double acceptable_px, int limit) const {
  SharedMatrix information = knowledge_.information;
  for (int views = 0; views < limit; ++views) {
    const LensMatrix covariance = information.inverse().topLeftCorner<kLensCount, kLensCount>();
    if (ProjectionUncertaintyOf(lens(), covariance, size_, distance_m_).max_px <= acceptable_px)
      return views;
    const auto best = std::ranges::min_element(candidates_, {}, [&](const Candidate& candidate) {
      return MeanVariance(information + candidate.information);
    });
    information += best->information;
  }
  return limit;
}

namespace {

// What a hand does not notice.
constexpr double kPlaceUnit = 0.05;  ///< share of the image's width
constexpr double kDistanceUnit = 0.1;
constexpr double kTurnUnit_rad = 0.12;

}  // namespace

HandCorrection CorrectionTowards(const Pose& X_wanted, const Pose& X_seen,
                                 const target::Board& board, const lens::Lens& lens,
                                 image::ImageSize size) {
  const Vec3 centre_K(board.Centre().x(), board.Centre().y(), 0);
  const Vec3 wanted_C = X_wanted * centre_K, seen_C = X_seen * centre_K;
  const lens::Vec2 shift =
      (Project(lens, wanted_C) - Project(lens, seen_C)) / (kPlaceUnit * size.width);
  const Vec3 turn = VectorFromRotation(X_wanted.R * X_seen.R.transpose()) / kTurnUnit_rad;
  return {
      shift.x(), shift.y(), std::log(wanted_C.z() / seen_C.z()) / kDistanceUnit,
      // A positive turn about y brings the right edge towards the camera, about x the upper one.
      turn.y(), turn.x(), turn.z()};
}

namespace {

/// Direction of a move in the image, one of eight.
lens::BoardPrompt MoveFor(double right, double down) {
  using lens::BoardPrompt;
  constexpr BoardPrompt kOctants[] = {
      BoardPrompt::kRight, BoardPrompt::kLowerRight, BoardPrompt::kDown, BoardPrompt::kLowerLeft,
      BoardPrompt::kLeft,  BoardPrompt::kUpperLeft,  BoardPrompt::kUp,   BoardPrompt::kUpperRight};
  const auto octant = std::lround(4 * std::atan2(down, right) / std::numbers::pi);
  return kOctants[(octant + 8) % 8];
}

}  // namespace

std::array<HandPart, 5> PartsOf(const HandCorrection& c) {
  using lens::BoardPrompt;
  const auto either = [](double size, BoardPrompt positive, BoardPrompt negative) {
    return HandPart{size > 0 ? positive : negative, std::abs(size)};
  };
  return {{{MoveFor(c.right, c.down), std::hypot(c.right, c.down)},
           either(c.farther, BoardPrompt::kFarther, BoardPrompt::kCloser),
           either(c.right_edge, BoardPrompt::kTiltRight, BoardPrompt::kTiltLeft),
           either(c.upper_edge, BoardPrompt::kTiltUpper, BoardPrompt::kTiltLower),
           either(c.clockwise, BoardPrompt::kClockwise, BoardPrompt::kCounterclockwise)}};
}

std::size_t PartToCorrect(const HandCorrection& correction, std::optional<std::size_t> previous) {
  const auto parts = PartsOf(correction);
  if (previous && parts[*previous].size > 1) return *previous;
  return static_cast<std::size_t>(std::ranges::max_element(parts, {}, &HandPart::size) -
                                  parts.begin());
}

}  // namespace plumbline::vision
