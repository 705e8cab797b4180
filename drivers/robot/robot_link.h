// Thread that communicates with the robot controller on behalf of the control cycle.
//
// The control cycle calls RequestRead() at each tick and waits a bounded time for the state, so a
// slow controller delays only this thread.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <string_view>
#include <thread>

#include "drivers/latest.h"
#include "drivers/robot/robot.h"
#include "drivers/thread_heartbeat.h"

namespace plumbline::robot {

inline constexpr std::size_t kMaxPushPoints = 64;
inline constexpr double kWithdrawal_s = 1;  ///< time limit for withdrawing the slots in Stop()

/// Fixed-capacity text that is copied without allocation; longer texts are truncated.
struct ShortText {
  std::array<char, 200> characters{};
  std::size_t size = 0;

  void Assign(std::string_view text);
  std::string_view view() const { return {characters.data(), size}; }
};

/// Status of the link. A logger that remembers `changes` logs each transition exactly once.
struct RobotLinkStatus {
  bool connected = false;                    ///< the last reading succeeded
  LinkResult result = LinkResult::kWaiting;  ///< of the last reading; between attempts, of theirs
  ShortText problem;                         ///< error of the last failed reading
  std::uint64_t changes = 0;                 ///< transitions from or to connected
  double since_s = 0;  ///< MonotonicSeconds() of the last transition, or of Start()
  std::uint64_t readings = 0;
  std::uint64_t failures = 0;
  std::uint64_t reconnects = 0;  ///< transitions to connected after the first
  LinkResult push_result = LinkResult::kOk;
  ShortText push_problem;
  std::uint64_t push_changes = 0;  ///< transitions of push_result
  /// Notices of the device so far; number k is notices[k % kKeptNotices].
  static constexpr std::size_t kKeptNotices = 4;
  std::uint64_t notice_count = 0;
  std::array<ShortText, kKeptNotices> notices{};
};

/// Thread-safe, except that Start() and Stop() must be called from the same thread.
class RobotLink {
 public:
  explicit RobotLink(std::unique_ptr<RobotDevice> device);
  ~RobotLink();
  RobotLink(const RobotLink&) = delete;
  RobotLink& operator=(const RobotLink&) = delete;

  void Start();
  /// Requests the thread to stop, without waiting; ended() becomes true once it has stopped.
  void RequestStop();
  /// True if the thread is not running.
  bool ended() const { return ended_; }
  /// Stops the thread; waits for a reading in progress (bounded by its timeouts and by name
  /// resolution). Then withdraws the pushed points within kWithdrawal_s; Status().push_result
  /// reports whether that succeeded.
  void Stop();

  /// Requests a reading that starts after this call. Does not wait; requests made while the thread
  /// is busy are served together by the next reading.
  void RequestRead();

  /// Waits until the last request was served. Returns true if its reading succeeded.
  bool WaitForState(std::chrono::steady_clock::time_point deadline);

  model::RobotState Latest() const;  ///< last successful reading; sequence 0 before the first
  RobotLinkStatus Status() const;
  /// Heartbeat, incremented before each reading and each push; their timeouts bound the interval.
  const ThreadHeartbeat& heartbeat() const { return heartbeat_; }

  /// Queues points for the controller. They are pushed once: at once if the last reading succeeded
  /// and none is requested, else after the next successful one; a later call before that replaces
  /// them. Points beyond kMaxPushPoints are dropped.
  void QueuePush(std::span<const PushPoint> points);

 private:
  void Run();
  void NoteReading(LinkResult result, const model::RobotState& state, std::uint64_t request);
  void NotePush(LinkResult result);
  void NoteNotice();
  void PublishStatus();

  std::unique_ptr<RobotDevice> device_;
  std::thread thread_;
  std::atomic<bool> ended_{true};
  ThreadHeartbeat heartbeat_;
  /// Serialises the readers of the status, which are not real-time; the link's thread never waits
  /// for them.
  mutable std::mutex status_readers_;
  plumbline::Latest<RobotLinkStatus> published_status_{1, RobotLinkStatus()};

  mutable std::mutex mutex_;  ///< guards all members below; held only while copying
  std::condition_variable wake_;
  std::condition_variable served_changed_;
  bool stop_ = false;
  std::uint64_t requested_ = 0;
  std::uint64_t served_ = 0;
  model::RobotState latest_;
  RobotLinkStatus status_;
  std::array<PushPoint, kMaxPushPoints> queued_;
  std::size_t queued_count_ = 0;
  bool may_push_ = false;  ///< the last reading since Start() succeeded
};

}  // namespace plumbline::robot
