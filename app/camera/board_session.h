// One capture of the board, from the first frame to a lens that is accepted or refused.
#pragma once

#include <deque>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "app/lens/calibration.h"
#include "firmware-like/lens/board_prompt.h"

namespace plumbline {

struct BoardSettings {
  Board board;
  int views = 20;           ///< that are kept before the lens is judged first
  int most_views = 60;      ///< then it is refused, whatever may still come
  double patience_s = 180;  ///< likewise
  CalibrationOptions options;
};

/// Takes what the detector finds in each frame and keeps the views that add information: whole,
/// sharp, at rest, and elsewhere or otherwise tilted than those that are kept. Says what to show
/// next: the view that would make the projection least uncertain at its worst place. Pure: time
/// comes with the frames.
class BoardSession {
 public:
  enum class State { kCapturing, kAccepted, kRefused };

  BoardSession(const BoardSettings& settings, ImageSize size, double now_s);

  /// A frame with the board.
  void Take(BoardView view);
  /// A frame without one; `why` in the detector's words.
  void TakeMiss(const std::string& why, double time_s);

  State state() const { return state_; }
  BoardPrompt prompt() const { return prompt_; }
  /// Solved as soon as there are enough views; what was kept last where it was refused.
  const std::optional<LensCalibration>& calibration() const { return calibration_; }
  const std::vector<std::string>& reasons() const { return reasons_; }  ///< of kRefused
  std::size_t kept() const { return kept_.size(); }
  const std::vector<BoardView>& views() const { return kept_; }
  double oldest_s() const;  ///< when the oldest kept view was taken
  /// Why the last frame was not kept; empty where it was.
  const std::string& last_word() const { return last_word_; }

 private:
  std::string Objection(const BoardView& view);
  double NoveltyOf(const BoardView& view) const;
  std::set<BoardPrompt> ShownAlready(const Lens& lens) const;
  void Keep(BoardView view);
  void ChoosePrompt();
  void Judge();
  void Expire(double time_s);
  void Refuse(std::string reason);

  BoardSettings settings_;
  ImageSize size_;
  double began_s_;
  State state_ = State::kCapturing;
  BoardPrompt prompt_ = BoardPrompt::kShowBoard, wanted_ = BoardPrompt::kTiltLeft;
  int kept_under_wanted_ = 0, alike_ = 0;  ///< alike: not kept for it since the last that was
  std::set<BoardPrompt> spent_;            ///< asked for in vain, till every one was
  std::vector<BoardView> kept_;
  std::optional<BoardView> previous_;
  std::deque<double> blurs_;  ///< of the last frames
  std::size_t judge_at_;
  std::optional<LensCalibration> calibration_;
  std::vector<std::string> reasons_;
  std::string last_word_, last_miss_;
};

}  // namespace plumbline
