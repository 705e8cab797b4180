// The thread beside the cycle that talks to the controller.
//
// The cyclic thread calls RequestRead() at each tick and waits a bounded time for the state; how
// long the controller takes is this thread's affair only.
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
#include "drivers/thread_heartbeat.h"
#include "drivers/robot/robot.h"

namespace plumbline {

inline constexpr std::size_t kMaxPushPoints = 64;
inline constexpr double kWithdrawal_s = 1;  ///< longest, at the end

/// A text that is copied without allocation.
struct ShortText {
  std::array<char, 200> characters{};
  std::size_t size = 0;

  void Assign(std::string_view text);
  std::string_view view() const { return {characters.data(), size}; }
};

/// How the link stands. `changes` counts its transitions, so that a logger that remembers it
/// says each transition once.
struct RobotLinkStatus {
  bool connected = false;  ///< the last reading succeeded
  LinkResult result = LinkResult::kWaiting;
  ShortText problem;          ///< of the last reading that failed
  std::uint64_t changes = 0;  ///< from or to connected
  double since_s = 0;         ///< MonotonicSeconds() of the last change, or of Start()
  std::uint64_t readings = 0;
  std::uint64_t failures = 0;
  std::uint64_t reconnects = 0;  ///< changes to connected after the first
  LinkResult push_result = LinkResult::kOk;
  ShortText push_problem;
  std::uint64_t push_changes = 0;  ///< of push_result
};

/// Safe to use from several threads, except that Start() and Stop() belong to one.
class RobotLink {
 public:
  explicit RobotLink(std::unique_ptr<RobotDevice> device);
  ~RobotLink();
  RobotLink(const RobotLink&) = delete;
  RobotLink& operator=(const RobotLink&) = delete;

  void Start();
  /// Has the thread end, and does not wait; ended() tells when it has.
  void AskToStop();
  /// True where no thread runs or is about to.
  bool ended() const { return ended_; }
  /// Ends the thread; waits for a reading under way (its time-outs, and a name being resolved).
  /// What was pushed is withdrawn then, which takes at most kWithdrawal_s; Status().push_result
  /// tells whether it was.
  void Stop();

  /// Asks for a reading that begins after this call. Does not wait; a request that finds the
  /// thread busy is served once by the next reading.
  void RequestRead();

  /// Waits until the last request was served. True where its reading succeeded.
  bool WaitForState(std::chrono::steady_clock::time_point deadline);

  RobotState Latest() const;  ///< the last that was read; sequence 0 before the first
  RobotLinkStatus Status() const;
  /// Raised before each reading and each push: how long one may take is its time-outs' affair.
  const Pulse& heartbeat() const { return pulse_; }

  /// Points for the controller, handed to the device once, after the next reading that succeeds;
  /// a later call before that replaces them. Points beyond kMaxPushPoints are not taken.
  void QueuePush(std::span<const PushPoint> points);

 private:
  void Run();
  void NoteReading(LinkResult result, const RobotState& state, std::uint64_t request);
  void NotePush(LinkResult result);
  void TellStatus();

  std::unique_ptr<RobotDevice> device_;
  std::thread thread_;
  std::atomic<bool> ended_{true};
  Pulse pulse_;
  /// Whoever asks for the status is not real-time: askers wait for one another, never this thread
  /// for them.
  mutable std::mutex asking_;
  plumbline::Latest<RobotLinkStatus> told_{1, RobotLinkStatus()};

  mutable std::mutex mutex_;  ///< guards all below; held for copies only
  std::condition_variable wake_;
  std::condition_variable served_changed_;
  bool stop_ = false;
  std::uint64_t requested_ = 0;
  std::uint64_t served_ = 0;
  RobotState latest_;
  RobotLinkStatus status_;
  std::array<PushPoint, kMaxPushPoints> queued_;
  std::size_t queued_count_ = 0;
};

}  // namespace plumbline
