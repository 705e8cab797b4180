#include "app/vision/camera/board_session.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

#include "app/vision/lens/projection_uncertainty.h"
#include "firmware-like/geometry/rotation.h"
#include "firmware-like/statistics/statistics.h"

namespace plumbline::vision {
namespace {

constexpr double kTilt_rad = 0.5, kCornerTilt_rad = 0.3;
/// Share of the image's width or height that the board fills.
constexpr double kUsualShare = 0.5;
constexpr double kCloseShare = 0.9, kFarShare = 0.35, kCornerShare = 0.4;
constexpr double kMaxOutside = 0.1;  ///< share of corners outside the image

/// Where a prompt places the board: its centre (-1..1 over the space it leaves in the image), its
/// tilts [rad] and the share of the image that it fills.
struct PromptPlacement {
  lens::BoardPrompt prompt;
  double right, down, about_x, about_y, share;
};
constexpr double t = kTilt_rad, c = kCornerTilt_rad;
// A positive turn about y brings the right edge towards the camera, about x the upper one.
constexpr std::array<PromptPlacement, 10> kPlacements = {{
    {lens::BoardPrompt::kTiltLeft, 0, 0, 0, -t, kUsualShare},
    {lens::BoardPrompt::kTiltRight, 0, 0, 0, t, kUsualShare},
    {lens::BoardPrompt::kTiltUpper, 0, 0, t, 0, kUsualShare},
    {lens::BoardPrompt::kTiltLower, 0, 0, -t, 0, kUsualShare},
    {lens::BoardPrompt::kUpperLeft, -1, -1, c, -c, kCornerShare},
    {lens::BoardPrompt::kUpperRight, 1, -1, c, c, kCornerShare},
    {lens::BoardPrompt::kLowerLeft, -1, 1, -c, -c, kCornerShare},
    {lens::BoardPrompt::kLowerRight, 1, 1, -c, c, kCornerShare},
    {lens::BoardPrompt::kCloser, 0, 0, c, c, kCloseShare},
    {lens::BoardPrompt::kFarther, 0, 0, c, -c, kFarShare},
}};

Pose PoseOfPlacement(const PromptPlacement& placement, const target::Board& board,
                     const lens::Lens& lens, image::ImageSize size) {
  const double width_m = 2 * board.Centre().x(), height_m = 2 * board.Centre().y();
  const double z = std::max(lens.fx * width_m / (placement.share * size.width),
                            lens.fy * height_m / (placement.share * size.height));
  const double u = 0.5 * size.width + placement.right * 0.5 * (1 - placement.share) * size.width;
  const double v = 0.5 * size.height + placement.down * 0.5 * (1 - placement.share) * size.height;
  Pose X;
  X.R = RotationFromVector(Vec3(placement.about_x, placement.about_y, 0));
  const Vec3 centre_C((u - lens.cx) / lens.fx * z, (v - lens.cy) / lens.fy * z, z);
  X.p = centre_C - X.R * Vec3(board.Centre().x(), board.Centre().y(), 0);
  return X;
}

}  // namespace

std::optional<SharedMatrix> InformationOfView(const target::Board& board,
                                              const SharedVector& shared, const Pose& X_CK,
                                              image::ImageSize size, double sigma_px) {
  const Eigen::Index n = board.corners();
  std::vector<lens::Vec2> pixels;
  std::vector<double> by_shared(static_cast<std::size_t>(2 * n * kSharedCount));
  std::vector<double> by_pose(static_cast<std::size_t>(2 * n * 6));
  if (!BoardPixels(board, shared, X_CK.R, Vec3::Zero(), X_CK.p, pixels, by_shared.data(),
                   by_pose.data())) {
    return std::nullopt;
  }
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  Eigen::MatrixXd S = Eigen::Map<RowMajor>(by_shared.data(), 2 * n, kSharedCount);
  Eigen::MatrixXd P = Eigen::Map<RowMajor>(by_pose.data(), 2 * n, 6);
  Eigen::Index outside = 0;
  for (Eigen::Index k = 0; k < n; ++k) {
    const lens::Vec2& at = pixels[k];
    const bool inside =
        at.allFinite() && at.x() >= 0 && at.y() >= 0 && at.x() < size.width && at.y() < size.height;
    if (inside) continue;
    ++outside;
    S.middleRows<2>(2 * k).setZero();
    P.middleRows<2>(2 * k).setZero();
  }
  if (static_cast<double>(outside) > kMaxOutside * static_cast<double>(n)) return std::nullopt;
  const Eigen::MatrixXd PtS = P.transpose() * S;
  const Eigen::MatrixXd information =
      S.transpose() * S - PtS.transpose() * (P.transpose() * P).ldlt().solve(PtS);
  if (!information.allFinite()) return std::nullopt;
  return SharedMatrix(information / (sigma_px * sigma_px));
}

Pose PoseOfPrompt(lens::BoardPrompt prompt, const target::Board& board, const lens::Lens& lens,
                  image::ImageSize size) {
  const auto* placement = std::ranges::find_if(
      kPlacements, [&](const PromptPlacement& p) { return p.prompt == prompt; });
  return PoseOfPlacement(placement != kPlacements.end() ? *placement : kPlacements[0], board, lens,
                         size);
}

lens::BoardPrompt BestPrompt(const target::Board& board, const LensFit& fit, image::ImageSize size,
                             const std::set<lens::BoardPrompt>& avoid) {
  const lens::Lens lens = LensFromShared(fit.shared);
  lens::BoardPrompt best = lens::BoardPrompt::kShowBoard;
  double least = INFINITY;
  for (const PromptPlacement& placement : kPlacements) {
    if (avoid.contains(placement.prompt)) continue;
    const auto information = InformationOfView(
        board, fit.shared, PoseOfPlacement(placement, board, lens, size), size, fit.sigma_px);
    if (!information) continue;
    // C' = (C^-1 + I)^-1 = C (1 + I C)^-1, which avoids inverting C: dropped terms have zero
    // variance.
    const SharedMatrix gained =
        fit.covariance * (SharedMatrix::Identity() + *information * fit.covariance).inverse();
    const LensMatrix covariance = gained.topLeftCorner<kLensCount, kLensCount>();
    const double worst = ProjectionUncertaintyOf(lens, covariance, size).max_px;
    if (worst < least) least = worst, best = placement.prompt;
  }
  return best;
}

namespace {

/// A view is new if its corners differ by this share of the image's diagonal (RMS) from those of
/// every kept view.
constexpr double kMinNovelty = 0.02;
/// Motion between frames above which motion blur or a rolling shutter would distort the view.
constexpr double kMaxMotion_px = 3;
constexpr double kMaxFrameGap_s = 0.25;  ///< frames further apart are not compared for motion
/// A frame is blurred if its edges are this much wider than the median of recent frames ..
constexpr double kMaxBlurRatio = 1.5;
constexpr double kAlwaysSharp_px = 1.2;  ///< .. and wider than this
constexpr std::size_t kRecentBlurs = 40;
constexpr std::size_t kMinViewsForFit = 3;
constexpr std::size_t kFurtherViews = 5;  ///< between two judgements
constexpr int kMaxViewsPerPrompt = 2;
constexpr double kSufficientShare = 0.9;  ///< of the image
constexpr int kMaxRedundantFrames = 40;   ///< then another prompt is chosen

/// Prompts before a lens can be fitted: the tilts that make a fit possible.
constexpr lens::BoardPrompt kFirst[] = {lens::BoardPrompt::kTiltLeft, lens::BoardPrompt::kTiltUpper,
                                        lens::BoardPrompt::kTiltRight};

/// RMS distance over the points that both views show [px]; infinite if they share none (possible
/// with partial views of a ChArUco board).
double Distance(const BoardView& a, const BoardView& b) {
  double sum = 0;
  int count = 0;
  for (std::size_t k = 0; k < a.corners_px.size() && k < b.corners_px.size(); ++k) {
    if (!a.seen[k] || !b.seen[k]) continue;
    sum += (a.corners_px[k] - b.corners_px[k]).squaredNorm();
    ++count;
  }
  return count > 0 ? std::sqrt(sum / count) : INFINITY;
}

}  // namespace

BoardSession::BoardSession(const BoardSettings& settings, image::ImageSize size, double now_s)
    : settings_(settings),
      size_(size),
      start_s_(now_s),
      judge_at_count_(static_cast<std::size_t>(settings.views)) {}

double BoardSession::oldest_s() const {
  return kept_.empty() ? INFINITY : kept_.front().time_s;
}

double BoardSession::NoveltyOf(const BoardView& view) const {
  double nearest = INFINITY;
  for (const BoardView& other : kept_) nearest = std::min(nearest, Distance(view, other));
  return nearest / std::hypot(size_.width, size_.height);
}

/// Prompts whose exact view would resemble one that is already kept.
std::set<lens::BoardPrompt> BoardSession::PromptsAlreadyShown(const lens::Lens& lens) const {
  std::set<lens::BoardPrompt> shown;
  for (int number = static_cast<int>(lens::BoardPrompt::kTiltLeft); number < lens::kBoardPrompts;
       ++number) {
    const auto prompt = static_cast<lens::BoardPrompt>(number);
    const Pose X_CK = PoseOfPrompt(prompt, settings_.board, lens, size_);
    BoardView view;
    for (int k = 0; k < settings_.board.corners(); ++k) {
      const lens::Vec2 corner = settings_.board.Corner(k);
      const Vec3 p_C = X_CK * Vec3(corner.x(), corner.y(), 0);
      view.seen.push_back(p_C.z() > 0);
      view.corners_px.push_back(p_C.z() > 0 ? Project(lens, p_C) : lens::Vec2(0, 0));
    }
    if (NoveltyOf(view) < kMinNovelty) shown.insert(prompt);
  }
  return shown;
}

/// Why a view is not kept; empty if it is. Also updates the prompt.
std::string BoardSession::ReasonToReject(const BoardView& view) {
  std::vector<double> blurs(recent_blur_px_.begin(), recent_blur_px_.end());
  const double median = blurs.empty() ? view.blur_px : statistics::MedianOf(blurs);
  recent_blur_px_.push_back(view.blur_px);
  if (recent_blur_px_.size() > kRecentBlurs) recent_blur_px_.pop_front();
  if (view.blur_px > std::max(kAlwaysSharp_px, kMaxBlurRatio * median)) {
    prompt_ = lens::BoardPrompt::kHoldStill;
    return fmt::format("blurred: edges {:.1f} px wide", view.blur_px);
  }
  if (previous_ && view.time_s - previous_->time_s < kMaxFrameGap_s) {
    const double moved = Distance(view, *previous_);
    if (moved > kMaxMotion_px) {
      prompt_ = lens::BoardPrompt::kHoldStill;
      return std::isfinite(moved)
                 ? fmt::format("moved by {:.1f} px since the previous frame", moved)
                 : "shows another part of the board than the previous frame";
    }
  }
  prompt_ = wanted_;
  if (NoveltyOf(view) < kMinNovelty) return "too similar to a view that is already kept";
  return {};
}

void BoardSession::Take(BoardView view) {
  if (state_ != State::kCapturing) return;
  rejection_ = ReasonToReject(view);
  previous_ = view;
  const double time_s = view.time_s;
  if (rejection_.empty()) {
    Keep(std::move(view));
  } else if (prompt_ == wanted_ && ++redundant_ >= kMaxRedundantFrames) {
    exhausted_.insert(wanted_);  // the prompted view does not come, or is already covered
    ChoosePrompt();
  }
  CheckTimeout(time_s);
}

void BoardSession::TakeFailure(const std::string& why, double time_s) {
  if (state_ != State::kCapturing) return;
  rejection_ = last_miss_reason_ = why;
  previous_.reset();
  prompt_ = lens::BoardPrompt::kShowBoard;
  CheckTimeout(time_s);
}

void BoardSession::Keep(BoardView view) {
  view.name = fmt::format("view {}", kept_.size() + 1);
  kept_.push_back(std::move(view));
  ++kept_for_wanted_;
  redundant_ = 0;
  if (kept_.size() >= judge_at_count_) {
    Judge();
    if (state_ != State::kCapturing) return;
  }
  ChoosePrompt();
}

void BoardSession::ChoosePrompt() {
  const lens::BoardPrompt before = wanted_;
  if (kept_.size() < kMinViewsForFit) {
    wanted_ = kFirst[kept_.size()];
  } else if (const auto fit = FitLens(settings_.board, kept_, size_)) {
    std::set<lens::BoardPrompt> avoid = PromptsAlreadyShown(LensFromShared(fit->shared));
    avoid.insert(exhausted_.begin(), exhausted_.end());
    if (kept_for_wanted_ >= kMaxViewsPerPrompt) avoid.insert(before);
    wanted_ = BestPrompt(settings_.board, *fit, size_, avoid);
    if (wanted_ ==
        lens::BoardPrompt::kShowBoard) {  // by hand, the same prompt always gives a new view
      exhausted_.clear();
      wanted_ = BestPrompt(settings_.board, *fit, size_, {before});
    }
  }
  if (wanted_ != before) kept_for_wanted_ = redundant_ = 0;
  prompt_ = wanted_;
}

void BoardSession::Judge() {
  calibration_ = CalibrateLens(settings_.board, kept_, size_, settings_.options);
  const bool full = kept_.size() >= static_cast<std::size_t>(settings_.max_views);
  // Further views are asked for if they would make the lens usable in much more of the image.
  const bool enough =
      !calibration_->further_views_help || UsableShare(*calibration_) >= kSufficientShare;
  if (calibration_->accepted && (enough || full)) {
    Accept();
    return;
  }
  reasons_ = calibration_->reasons;
  judge_at_count_ = kept_.size() + kFurtherViews;
  if (full || !calibration_->further_views_help) {
    state_ = State::kRefused;
    prompt_ = lens::BoardPrompt::kNone;
  }
}

void BoardSession::Accept() {
  state_ = State::kAccepted;
  prompt_ = lens::BoardPrompt::kNone;
}

void BoardSession::CheckTimeout(double time_s) {
  if (state_ != State::kCapturing || time_s - start_s_ < settings_.patience_s) return;
  if (kept_.size() > kMinViewsForFit && !calibration_) Judge();
  if (state_ == State::kAccepted) return;
  if (calibration_ && calibration_->accepted) {
    Accept();
    return;
  }
  Refuse(fmt::format("not accepted within {:.0f} s; {} views kept{}", settings_.patience_s,
                     kept_.size(),
                     last_miss_reason_.empty() ? "" : "; last frame: " + last_miss_reason_));
}

void BoardSession::Refuse(std::string reason) {
  reasons_.push_back(std::move(reason));
  state_ = State::kRefused;
  prompt_ = lens::BoardPrompt::kNone;
}

}  // namespace plumbline::vision
