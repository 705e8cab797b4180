// Board detection in a separate process that can be killed when it hangs.
#pragma once

#include <optional>
#include <string>

#include "app/base/target/board.h"
#include "app/vision/lens/board_view.h"
#include "drivers/clock.h"
#include "drivers/os/child_process.h"
#include "drivers/os/descriptor.h"
#include "firmware-like/image/luma_view.h"
#include "firmware-like/result.h"

namespace plumbline::vision {

/// Sends one frame at a time to `PROGRAM board-worker` and receives its response. A worker that
/// misses the deadline is killed. After that, or if the worker exits, the next frame starts a new
/// one. The kernel kills the worker when the thread that started it ends. Never blocks. For use by
/// one thread.
class BoardWorker {
 public:
  static constexpr double kDeadline_s = 0.2;
  static constexpr double kStartupDeadline_s = 10;  ///< for the first frame: the program must load

  /// @param program  path of `plumbline`
  BoardWorker(std::string program, Clock clock);
  ~BoardWorker();
  BoardWorker(const BoardWorker&) = delete;
  BoardWorker& operator=(const BoardWorker&) = delete;

  bool idle() const { return !sent_s_; }
  /// Submits a frame; only while idle. The image is copied.
  /// @param board  any kind of board for which FaultOf(board) is nullopt
  /// @return       an error if the frame could not be submitted
  Result<void> Submit(const image::LumaView& image, const target::Board& board);
  /// The response to the submitted frame, once; nullopt while it is being processed.
  std::optional<Result<BoardView>> Poll();
  int failures() const { return failures_; }  ///< workers that were killed or exited

 private:
  Result<void> Start();
  Result<void> CopyToSharedMemory(const image::LumaView& image);
  void StopWorker();
  Result<BoardView> Fail(const std::string& why);

  const std::string program_;
  const Clock clock_;
  os::ChildProcess child_;
  os::Descriptor socket_, memory_;
  std::uint8_t* shared_ = nullptr;
  std::size_t shared_bytes_ = 0;
  std::optional<double> sent_s_;
  std::size_t expected_points_ = 0;  ///< points of the submitted board
  bool has_responded_ = false;       ///< this worker has responded at least once
  int failures_ = 0;
};

/// Worker side: serves requests from the inherited socket, with images in the inherited shared
/// memory, until the socket closes.
/// @return  the process's exit code
int RunBoardWorker();

}  // namespace plumbline::vision
