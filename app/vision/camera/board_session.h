// One capture of the calibration board, from the first frame to an accepted or refused lens.
#pragma once

#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "app/vision/camera/next_view.h"
#include "app/vision/lens/board_view.h"
#include "app/vision/lens/calibration.h"
#include "firmware-like/image/image_size.h"
#include "firmware-like/lens/board_guidance.h"
#include "firmware-like/lens/board_prompt.h"

namespace plumbline::vision {

struct BoardSettings {
  target::Board board;
  int views = 6;            ///< views to keep before the first calibration attempt
  int max_views = 60;       ///< if the lens is not good enough by then, the capture is refused
  double patience_s = 180;  ///< likewise, by time since the start
  CalibrationOptions options;
};

/// Receives the detections of each frame and keeps the views that add nearly as much as the next
/// best view would: complete, sharp, stationary, and where the guidance shows them or in a place
/// that is as good. Ends when the claim is met: the lens is accepted, and usable in nearly all of
/// the image or as far as views can make it. Pure: the time is that of the frames.
class BoardSession {
 public:
  enum class State { kCapturing, kAccepted, kRefused };

  BoardSession(const BoardSettings& settings, image::ImageSize size, double now_s);

  /// A frame in which the board was detected.
  void Take(BoardView view);
  /// A frame in which no board was detected. @param why  the detector's reason
  void TakeFailure(const std::string& why, double time_s);

  State state() const { return state_; }
  /// The one instruction to the person.
  lens::BoardPrompt prompt() const { return prompt_; }
  const lens::BoardGuidance& guidance() const { return guidance_; }
  /// The choice of the next view.
  const NextViewChoice& next_view() const { return *choice_; }
  /// Set once there are enough views; if refused, the last attempt.
  const std::optional<LensCalibration>& calibration() const { return calibration_; }
  const std::vector<std::string>& reasons() const { return reasons_; }  ///< of kRefused
  std::size_t kept() const { return kept_.size(); }
  const std::vector<BoardView>& views() const { return kept_; }
  double oldest_s() const;  ///< time of the oldest kept view; infinite without one
  /// Why the last frame was not kept; empty if it was.
  const std::string& rejection() const { return rejection_; }

 private:
  std::string ReasonToReject(const BoardView& view);
  std::string Unsteadiness(const BoardView& view);
  double NoveltyOf(const BoardView& view) const;
  double NoveltyAt(const Pose& X_CK) const;
  void Keep(BoardView view);
  void ChooseNextView(double time_s);
  void ShowWantedView();
  void Judge();
  void End(State state);
  void CheckTimeout(double time_s);

  BoardSettings settings_;
  image::ImageSize size_;
  double start_s_;
  State state_ = State::kCapturing;
  lens::BoardPrompt prompt_ = lens::BoardPrompt::kShowBoard;
  std::optional<NextViewChoice> choice_;
  double chosen_s_ = 0;              ///< when the next view was chosen, or the board came into view
  std::optional<std::size_t> part_;  ///< of the correction that the prompt asks for
  lens::BoardGuidance guidance_;
  std::vector<BoardView> kept_;
  std::optional<BoardView> previous_;
  std::deque<double> recent_blur_px_;
  int hopeless_ = 0;  ///< consecutive judgements that further views cannot help
  std::optional<LensCalibration> calibration_;
  std::vector<std::string> reasons_;
  std::string rejection_, last_miss_reason_;
};

}  // namespace plumbline::vision
