#include "app/vision/camera/board_session.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/vision/lens/projection_uncertainty.h"
#include "firmware-like/statistics/statistics.h"

namespace plumbline::vision {
namespace {

/// A view is new if its corners differ by this share of the image's diagonal (RMS) from those of
/// every kept view: the errors of two detections in the same place are alike.
constexpr double kMinNovelty = 0.02;
/// Motion between frames above which motion blur or a rolling shutter would distort the view.
constexpr double kMaxMotion_px = 3;
constexpr double kMaxFrameGap_s = 0.25;  ///< frames further apart are not compared for motion
/// A frame is blurred if its edges are this much wider than the median of recent frames ..
constexpr double kMaxBlurRatio = 1.5;
constexpr double kAlwaysSharp_px = 1.2;  ///< .. and wider than this
constexpr std::size_t kRecentBlurs = 40;
/// A view is kept if it gains this share of what the next best view would.
constexpr double kMinGainShare = 0.6;
constexpr double kOutlineNovelty = 2 * kMinNovelty;  ///< a hand misses the outline by as much
constexpr int kMostAlternatives = 40;
constexpr double kPatienceWithView_s = 12;  ///< then another view is shown as the next one
constexpr double kSufficientShare = 0.9;    ///< of the image
/// Consecutive judgements: the first ones rest on few views.
constexpr int kHopelessToRefuse = 5;
constexpr int kMostExpectedViews = 30;       ///< beyond those already kept
constexpr double kLargestUncertainty = 1e6;  ///< in place of infinity where the lens folds back
constexpr double kNotYetCertain = 1.001;     ///< in units of the limit

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

/// "1 view", "2 views".
std::string ViewsText(std::size_t count) {
  return fmt::format("{} view{}", count, count == 1 ? "" : "s");
}

}  // namespace

BoardSession::BoardSession(const BoardSettings& settings, image::ImageSize size, double now_s)
    : settings_(settings), size_(size), start_s_(now_s) {
  ChooseNextView(now_s);
}

double BoardSession::oldest_s() const {
  return kept_.empty() ? INFINITY : kept_.front().time_s;
}

double BoardSession::NoveltyOf(const BoardView& view) const {
  double nearest = INFINITY;
  for (const BoardView& other : kept_) nearest = std::min(nearest, Distance(view, other));
  return nearest / std::hypot(size_.width, size_.height);
}

/// The same of the board at a pose.
double BoardSession::NoveltyAt(const Pose& X_CK) const {
  BoardView view;
  if (!BoardPixels(settings_.board, choice_->knowledge().shared, X_CK.R, Vec3::Zero(), X_CK.p,
                   view.corners_px, nullptr, nullptr)) {
    return INFINITY;
  }
  view.seen.assign(view.corners_px.size(), true);
  return NoveltyOf(view);
}

/// What is wrong with a frame whose board moves; empty if nothing is.
std::string BoardSession::Unsteadiness(const BoardView& view) {
  std::vector<double> blurs(recent_blur_px_.begin(), recent_blur_px_.end());
  const double median = blurs.empty() ? view.blur_px : statistics::MedianOf(blurs);
  recent_blur_px_.push_back(view.blur_px);
  if (recent_blur_px_.size() > kRecentBlurs) recent_blur_px_.pop_front();
  if (view.blur_px > std::max(kAlwaysSharp_px, kMaxBlurRatio * median))
    return fmt::format("blurred: edges {:.1f} px wide", view.blur_px);
  if (!previous_ || view.time_s - previous_->time_s >= kMaxFrameGap_s) return {};
  const double moved = Distance(view, *previous_);
  if (!(moved > kMaxMotion_px)) return {};
  return std::isfinite(moved) ? fmt::format("moved by {:.1f} px since the previous frame", moved)
                              : "shows another part of the board than the previous frame";
}

/// Why a view is not kept; empty if it is. Also updates prompt and guidance.
std::string BoardSession::ReasonToReject(const BoardView& view) {
  const std::string unsteadiness = Unsteadiness(view);
  guidance_.met = false;
  guidance_.seen_px.clear();
  const auto X_seen = choice_->SeenAt(view);
  if (!X_seen) {
    prompt_ = lens::BoardPrompt::kShowBoard;
    return "too little of the board is visible";
  }
  guidance_.seen_px = OutlineOf(settings_.board, choice_->lens(), *X_seen);
  const double share = choice_->GainAt(*X_seen) / choice_->gain();
  const bool is_new = NoveltyOf(view) >= kMinNovelty;
  guidance_.met = is_new && share >= kMinGainShare;
  if (guidance_.met) {
    prompt_ = lens::BoardPrompt::kHoldStill;
    part_.reset();
    return unsteadiness;
  }
  const HandCorrection correction =
      CorrectionTowards(choice_->X_CK(), *X_seen, settings_.board, choice_->lens(), size_);
  part_ = PartToCorrect(correction, part_);
  prompt_ = PartsOf(correction)[*part_].instruction;
  if (!is_new) return "too similar to a view that is already kept";
  return fmt::format("gains {:.0f} % of what the wanted view would", 100 * std::max(0.0, share));
}

void BoardSession::Take(BoardView view) {
  if (state_ != State::kCapturing) return;
  rejection_ = ReasonToReject(view);
  previous_ = view;
  const double time_s = view.time_s;
  if (rejection_.empty()) {
    Keep(std::move(view));
  } else if (time_s - chosen_s_ > kPatienceWithView_s) {
    choice_->ChooseAnother();
    chosen_s_ = time_s;
    ShowWantedView();
  }
  CheckTimeout(time_s);
}

void BoardSession::TakeFailure(const std::string& why, double time_s) {
  if (state_ != State::kCapturing) return;
  rejection_ = last_miss_reason_ = why;
  previous_.reset();
  prompt_ = lens::BoardPrompt::kShowBoard;
  guidance_.met = false;
  guidance_.seen_px.clear();
  chosen_s_ = time_s;
  CheckTimeout(time_s);
}

void BoardSession::Keep(BoardView view) {
  const double time_s = view.time_s;
  view.name = fmt::format("view {}", kept_.size() + 1);
  kept_.push_back(std::move(view));
  if (kept_.size() >= static_cast<std::size_t>(settings_.views)) Judge();
  if (state_ != State::kCapturing) return;
  ChooseNextView(time_s);
  // The first instruction towards the next view.
  if (const auto X_seen = choice_->SeenAt(kept_.back())) {
    const HandCorrection correction =
        CorrectionTowards(choice_->X_CK(), *X_seen, settings_.board, choice_->lens(), size_);
    part_ = PartToCorrect(correction, std::nullopt);
    prompt_ = PartsOf(correction)[*part_].instruction;
  }
}

void BoardSession::ChooseNextView(double time_s) {
  const LensKnowledge knowledge = KnowledgeFrom(settings_.board, kept_, size_);
  choice_.emplace(settings_.board, knowledge, size_, settings_.options.distance_m);
  // An outline where a view has been kept asks for one that would be too similar to it.
  for (int k = 0; k < kMostAlternatives && choice_->gain() > 0; ++k) {
    if (NoveltyAt(choice_->X_CK()) >= kOutlineNovelty) break;
    choice_->ChooseAnother();
  }
  if (!(choice_->gain() > 0))
    choice_.emplace(settings_.board, knowledge, size_, settings_.options.distance_m);
  chosen_s_ = time_s;
  const double acceptable_px = settings_.options.acceptable_px;
  // The claim may rest on more than the covariance: at least one more view is expected.
  const int further = std::max(1, choice_->ViewsUntil(acceptable_px, kMostExpectedViews));
  const int least = static_cast<int>(kept_.size()) + further;
  guidance_.views = static_cast<std::uint16_t>(kept_.size());
  guidance_.expected_views = static_cast<std::uint16_t>(std::max(settings_.views, least));
  const ProjectionUncertainty claim =
      calibration_ && calibration_->lens.fx > 0
          ? calibration_->uncertainty
          : ProjectionUncertaintyOf(choice_->lens(), choice_->knowledge().covariance(), size_,
                                    settings_.options.distance_m);
  guidance_.columns = static_cast<std::uint16_t>(claim.columns);
  guidance_.rows = static_cast<std::uint16_t>(claim.rows);
  guidance_.uncertainty.clear();
  // Nothing is certain before it has been judged.
  const double least_shown = calibration_ ? 0 : kNotYetCertain;
  for (const double sd_px : claim.sd_px)
    guidance_.uncertainty.push_back(
        static_cast<float>(std::clamp(sd_px / acceptable_px, least_shown, kLargestUncertainty)));
  ShowWantedView();
}

void BoardSession::ShowWantedView() {
  guidance_.met = false;
  part_.reset();
  guidance_.wanted_px = OutlineOf(settings_.board, choice_->lens(), choice_->X_CK());
}

void BoardSession::Judge() {
  calibration_ = CalibrateLens(settings_.board, kept_, size_, settings_.options);
  const bool full = kept_.size() >= static_cast<std::size_t>(settings_.max_views);
  // Further views are asked for if they would make the lens usable in much more of the image.
  const bool enough =
      !calibration_->further_views_help || UsableShare(*calibration_) >= kSufficientShare;
  reasons_ = calibration_->reasons;
  hopeless_ = calibration_->accepted || calibration_->further_views_help ? 0 : hopeless_ + 1;
  if (calibration_->accepted && (enough || full)) {
    End(State::kAccepted);
  } else if (full || hopeless_ >= kHopelessToRefuse) {
    End(State::kRefused);
  }
}

void BoardSession::End(State state) {
  state_ = state;
  prompt_ = lens::BoardPrompt::kNone;
  guidance_ = {};
}

void BoardSession::CheckTimeout(double time_s) {
  if (state_ != State::kCapturing || time_s - start_s_ < settings_.patience_s) return;
  if (!kept_.empty() && !calibration_) Judge();
  if (state_ == State::kAccepted) return;
  if (calibration_ && calibration_->accepted) {
    End(State::kAccepted);
    return;
  }
  reasons_.push_back(fmt::format(
      "not accepted within {:.0f} s; {} kept{}", settings_.patience_s, ViewsText(kept_.size()),
      last_miss_reason_.empty() ? "" : "; last frame: " + last_miss_reason_));
  End(State::kRefused);
}

}  // namespace plumbline::vision
