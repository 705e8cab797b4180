// The detection of the board in a process of its own, which can be ended.
#pragma once

#include <optional>
#include <string>

#include "app/lens/board.h"
#include "drivers/clock.h"
#include "drivers/os/child_process.h"
#include "drivers/os/descriptor.h"
#include "firmware-like/lens/luma_view.h"
#include "firmware-like/result.h"

namespace plumbline {

/// Sends one frame at a time to `PROGRAM board-worker` and takes its answer. A worker that has not
/// answered at the deadline, or died, is killed and another one started; the kernel kills it when
/// the thread that started it ends. Never waits. Used by one thread.
class BoardWorker {
 public:
  static constexpr double kDeadline_s = 0.2;
  static constexpr double kStart_s = 10;  ///< of the first frame: the program has to be loaded

  /// @param program  `plumbline`, by its path
  BoardWorker(std::string program, Clock clock);
  ~BoardWorker();
  BoardWorker(const BoardWorker&) = delete;
  BoardWorker& operator=(const BoardWorker&) = delete;

  bool idle() const { return !asked_s_; }
  /// Gives it a frame; only while idle. The image is copied. Any kind of board; FaultOf(board) is
  /// nothing. @return why it could not be given
  Result<void> Ask(const LumaView& image, const Board& board);
  /// The answer to the last frame, once; nothing while it is worked on.
  std::optional<Result<BoardView>> Poll();
  int ended() const { return ended_; }  ///< workers that had to be ended, or died

 private:
  Result<void> Start();
  Result<void> Share(const LumaView& image);
  void End();
  Result<BoardView> Failed(const std::string& why);

  const std::string program_;
  const Clock clock_;
  ChildProcess child_;
  Descriptor socket_, memory_;
  std::uint8_t* shared_ = nullptr;
  std::size_t shared_bytes_ = 0;
  std::optional<double> asked_s_;
  std::size_t points_ = 0;  ///< of the board that was asked for
  bool answered_ = false;   ///< this worker did once
  int ended_ = 0;
};

/// The worker's side: answers the requests of the socket it was started with, images in the memory
/// it was given, until the socket closes.
/// @return  the process's exit code
int RunBoardWorker();

}  // namespace plumbline
