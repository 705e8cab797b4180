#include "app/camera/board_session.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/camera/view_gain.h"
#include "firmware-like/statistics/median.h"

namespace plumbline {
namespace {

constexpr double kNovel = 0.02;          ///< of the image's diagonal, RMS over the corners
constexpr double kMoving_px = 3;         ///< from one frame to the next: smeared, or bent by a
                                         ///< shutter that rolls
constexpr double kFrameGap_s = 0.25;     ///< frames further apart say nothing of motion
constexpr double kBlurred = 1.5;         ///< times the middle of the last frames ..
constexpr double kAlwaysSharp_px = 1.2;  ///< .. unless below this
constexpr std::size_t kBlurs = 40;
constexpr std::size_t kLeastForFit = 3, kFurtherViews = 5;
constexpr int kPromptViews = 2;  ///< kept while a prompt stands, before another is chosen
constexpr int kAlike = 40;       ///< likewise, frames that show nothing new

/// Before a lens can be fitted: the tilts that make it possible.
constexpr BoardPrompt kFirst[] = {BoardPrompt::kTiltLeft, BoardPrompt::kTiltUpper,
                                  BoardPrompt::kTiltRight};

/// RMS over the points that both show [px]; infinite where there are none (parts of a ChArUco
/// board).
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

BoardSession::BoardSession(const BoardSettings& settings, ImageSize size, double now_s)
    : settings_(settings),
      size_(size),
      began_s_(now_s),
      judge_at_(static_cast<std::size_t>(settings.views)) {}

double BoardSession::oldest_s() const {
  return kept_.empty() ? INFINITY : kept_.front().time_s;
}

double BoardSession::NoveltyOf(const BoardView& view) const {
  double nearest = INFINITY;
  for (const BoardView& other : kept_) nearest = std::min(nearest, Distance(view, other));
  return nearest / std::hypot(size_.width, size_.height);
}

/// The prompts whose view, followed to the letter, would be like one that is kept.
std::set<BoardPrompt> BoardSession::ShownAlready(const Lens& lens) const {
  std::set<BoardPrompt> shown;
  for (int number = static_cast<int>(BoardPrompt::kTiltLeft); number < kBoardPrompts; ++number) {
    const auto prompt = static_cast<BoardPrompt>(number);
    const Pose X_CK = PoseOfPrompt(prompt, settings_.board, lens, size_);
    BoardView view;
    for (int k = 0; k < settings_.board.corners(); ++k) {
      const Vec2 corner = settings_.board.Corner(k);
      const Vec3 p_C = X_CK * Vec3(corner.x(), corner.y(), 0);
      view.seen.push_back(p_C.z() > 0);
      view.corners_px.push_back(p_C.z() > 0 ? Project(lens, p_C) : Vec2(0, 0));
    }
    if (NoveltyOf(view) < kNovel) shown.insert(prompt);
  }
  return shown;
}

/// Why a view is not kept; empty where it is.
std::string BoardSession::Objection(const BoardView& view) {
  std::vector<double> blurs(blurs_.begin(), blurs_.end());
  const double middle = blurs.empty() ? view.blur_px : MedianOf(blurs);
  blurs_.push_back(view.blur_px);
  if (blurs_.size() > kBlurs) blurs_.pop_front();
  if (view.blur_px > std::max(kAlwaysSharp_px, kBlurred * middle)) {
    prompt_ = BoardPrompt::kHoldStill;
    return fmt::format("blurred: edges {:.1f} px wide", view.blur_px);
  }
  if (previous_ && view.time_s - previous_->time_s < kFrameGap_s) {
    const double moved = Distance(view, *previous_);
    if (moved > kMoving_px) {
      prompt_ = BoardPrompt::kHoldStill;
      return std::isfinite(moved) ? fmt::format("moved by {:.1f} px since the last frame", moved)
                                  : "another part of the board than in the last frame";
    }
  }
  prompt_ = wanted_;
  if (NoveltyOf(view) < kNovel) return "like a view that is kept already";
  return {};
}

void BoardSession::Take(BoardView view) {
  if (state_ != State::kCapturing) return;
  last_word_ = Objection(view);
  previous_ = view;
  const double time_s = view.time_s;
  if (last_word_.empty()) {
    Keep(std::move(view));
  } else if (prompt_ == wanted_ && ++alike_ >= kAlike) {
    spent_.insert(wanted_);  // what was asked for does not come, or is there already
    ChoosePrompt();
  }
  Expire(time_s);
}

void BoardSession::TakeMiss(const std::string& why, double time_s) {
  if (state_ != State::kCapturing) return;
  last_word_ = last_miss_ = why;
  previous_.reset();
  prompt_ = BoardPrompt::kShowBoard;
  Expire(time_s);
}

void BoardSession::Keep(BoardView view) {
  view.name = fmt::format("view {}", kept_.size() + 1);
  kept_.push_back(std::move(view));
  ++kept_under_wanted_;
  alike_ = 0;
  if (kept_.size() >= judge_at_) {
    Judge();
    if (state_ != State::kCapturing) return;
  }
  ChoosePrompt();
}

void BoardSession::ChoosePrompt() {
  const BoardPrompt before = wanted_;
  if (kept_.size() < kLeastForFit) {
    wanted_ = kFirst[kept_.size()];
  } else if (const auto fit = FitLens(settings_.board, kept_, size_)) {
    std::set<BoardPrompt> avoid = ShownAlready(LensOfShared(fit->shared));
    avoid.insert(spent_.begin(), spent_.end());
    if (kept_under_wanted_ >= kPromptViews) avoid.insert(before);
    wanted_ = BestPrompt(settings_.board, *fit, size_, avoid);
    if (wanted_ == BoardPrompt::kShowBoard) {  // a hand is never twice at the same place
      spent_.clear();
      wanted_ = BestPrompt(settings_.board, *fit, size_, {before});
    }
  }
  if (wanted_ != before) kept_under_wanted_ = alike_ = 0;
  prompt_ = wanted_;
}

void BoardSession::Judge() {
  calibration_ = CalibrateLens(settings_.board, kept_, size_, settings_.options);
  if (calibration_->accepted) {
    state_ = State::kAccepted;
    prompt_ = BoardPrompt::kNone;
    return;
  }
  reasons_ = calibration_->reasons;
  judge_at_ = kept_.size() + kFurtherViews;
  const bool full = kept_.size() >= static_cast<std::size_t>(settings_.most_views);
  if (full || !calibration_->further_views_help) {
    state_ = State::kRefused;
    prompt_ = BoardPrompt::kNone;
  }
}

void BoardSession::Expire(double time_s) {
  if (state_ != State::kCapturing || time_s - began_s_ < settings_.patience_s) return;
  if (kept_.size() > kLeastForFit && !calibration_) Judge();
  if (state_ == State::kAccepted) return;
  Refuse(fmt::format("not accepted within {:.0f} s, {} views kept{}", settings_.patience_s,
                     kept_.size(), last_miss_.empty() ? "" : "; at last: " + last_miss_));
}

void BoardSession::Refuse(std::string reason) {
  reasons_.push_back(std::move(reason));
  state_ = State::kRefused;
  prompt_ = BoardPrompt::kNone;
}

}  // namespace plumbline
