// One capture of the calibration board, from the first frame to an accepted or refused lens.
#pragma once

#include <deque>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "app/vision/lens/board_view.h"
#include "app/vision/lens/calibration.h"
#include "app/vision/lens/lens_fit.h"
#include "firmware-like/image/image_size.h"
#include "firmware-like/lens/board_prompt.h"

namespace plumbline::vision {

// Information gain about the lens from one further view of the calibration board.

/// Fisher information about the shared parameters from a view of the board at X_CK, whose pose is
/// estimated too:
///   (sum J_s^T J_s - J_s^T J_p (J_p^T J_p)^-1 J_p^T J_s) / sigma^2
/// @return  nullopt if a corner is behind the camera or more than a tenth of the corners lie
///          outside the image
std::optional<SharedMatrix> InformationOfView(const target::Board& board,
                                              const SharedVector& shared, const Pose& X_CK,
                                              image::ImageSize size, double sigma_px);

/// Pose of the board (X_CK) if a prompt is followed; `lens` need only be roughly right.
Pose PoseOfPrompt(lens::BoardPrompt prompt, const target::Board& board, const lens::Lens& lens,
                  image::ImageSize size);

/// The prompt whose view would leave the smallest maximum projection uncertainty in the image;
/// candidates are tilts, image corners, closer and farther.
/// @param avoid  prompts to skip: their view is already covered, or they brought no new view
/// @return       kShowBoard if no candidate remains
lens::BoardPrompt BestPrompt(const target::Board& board, const LensFit& fit, image::ImageSize size,
                             const std::set<lens::BoardPrompt>& avoid = {});

struct BoardSettings {
  target::Board board;
  int views = 20;           ///< views to keep before the first calibration attempt
  int max_views = 60;       ///< if the lens is not good enough by then, the capture is refused
  double patience_s = 180;  ///< likewise, by time since the start
  CalibrationOptions options;
};

/// Receives the detections of each frame and keeps the views that add information: complete, sharp,
/// stationary, and with the board in a different position or tilt than in those already kept.
/// Prompts for the view that would most reduce the largest projection uncertainty in the image.
/// Pure: the time is that of the frames.
class BoardSession {
 public:
  enum class State { kCapturing, kAccepted, kRefused };

  BoardSession(const BoardSettings& settings, image::ImageSize size, double now_s);

  /// A frame in which the board was detected.
  void Take(BoardView view);
  /// A frame in which no board was detected. @param why  the detector's reason
  void TakeFailure(const std::string& why, double time_s);

  State state() const { return state_; }
  lens::BoardPrompt prompt() const { return prompt_; }
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
  double NoveltyOf(const BoardView& view) const;
  std::set<lens::BoardPrompt> PromptsAlreadyShown(const lens::Lens& lens) const;
  void Keep(BoardView view);
  void ChoosePrompt();
  void Judge();
  void Accept();
  void CheckTimeout(double time_s);
  void Refuse(std::string reason);

  BoardSettings settings_;
  image::ImageSize size_;
  double start_s_;
  State state_ = State::kCapturing;
  lens::BoardPrompt prompt_ = lens::BoardPrompt::kShowBoard, wanted_ = lens::BoardPrompt::kTiltLeft;
  int kept_for_wanted_ = 0;
  int redundant_ = 0;  ///< frames rejected as redundant since the last kept view or prompt change
  std::set<lens::BoardPrompt>
      exhausted_;  ///< prompts that brought no new view; cleared once all have
  std::vector<BoardView> kept_;
  std::optional<BoardView> previous_;
  std::deque<double> recent_blur_px_;
  std::size_t judge_at_count_;
  std::optional<LensCalibration> calibration_;
  std::vector<std::string> reasons_;
  std::string rejection_, last_miss_reason_;
};

}  // namespace plumbline::vision
