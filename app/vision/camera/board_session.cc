#include "app/vision/camera/board_session.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/vision/camera/view_gain.h"
#include "firmware-like/statistics/median.h"

namespace plumbline::vision {
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
