// Real-time thread that answers the packets of a controller's sensor interface with the offset of
// the running motion.
#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "drivers/lateness.h"
#include "drivers/latest.h"
#include "drivers/motion/motion_responder.h"
#include "drivers/os/descriptor.h"
#include "drivers/thread_heartbeat.h"
#include "firmware-like/motion_offset/motion_correction.h"
#include "firmware-like/status/motion_link_status.h"

namespace plumbline::motion_link {

/// Start(), RequestStop(), Stop() and UseModel() belong to one thread, Report() to the control
/// cycle; the others may be called by any thread.
///
/// Each packet is answered at once, from its own joints, with the newest report of the control
/// cycle. Packets that arrived together are answered by one answer, to the newest. Nothing is
/// allocated after the first packet.
class MotionLink {
 public:
  /// @return  why these settings cannot be used
  static Result<std::unique_ptr<MotionLink>> Create(const MotionSettings& settings);
  ~MotionLink();
  MotionLink(const MotionLink&) = delete;
  MotionLink& operator=(const MotionLink&) = delete;

  void Start();
  /// Lets the offset return to 0 at its ramp and rate, then ends the thread; does not wait.
  void RequestStop();
  /// True if the thread is not running.
  bool ended() const { return ended_; }
  /// RequestStop(), and waits: at most kLongestStop_s, after which nothing is answered.
  void Stop();

  /// The model from the next packet on. The previous one is released by this thread, later.
  void UseModel(std::shared_ptr<const motion_offset::MotionModel> model);
  /// Never waits. One thread.
  void Report(const motion_offset::CycleReport& report);

  /// At most kStatusReaders threads at a time.
  static constexpr int kStatusReaders = 3;
  status::MotionLinkStatus Status() const { return *status_.Read(); }
  /// How long after their arrival packets were answered.
  LatenessHistogram answers() const { return answers_.Counts(); }
  const ThreadHeartbeat& heartbeat() const { return heartbeat_; }
  const MotionSettings& settings() const { return settings_; }
  /// The port that is bound; 0 while there is none.
  int port() const { return port_; }
  /// Why the port cannot be opened; empty if it is open.
  std::string problem() const;

  /// kLongestReturn_s, and time for packets that come late.
  static constexpr double kLongestStop_s = motion_offset::kLongestReturn_s + 2;

 private:
  struct Arrival;

  MotionLink(MotionSettings settings, MotionResponder responder);
  void Run();
  bool OpenSocket();
  /// The next datagram, without waiting. @return  its size; negative: none
  long Receive(Arrival& arrival);
  /// Takes what has arrived, and answers the newest packet. @return  false: there is more
  bool Serve();
  /// From now on the kernel drops what does not come from the controller.
  void IgnoreOthers();
  void Answer(const Arrival& arrival);
  void TakeModel();
  void Publish();

  const MotionSettings settings_;
  os::Descriptor socket_;
  std::atomic<int> port_{0};
  std::thread thread_;
  std::atomic<bool> stop_{false}, ended_{true};
  std::atomic<double> stop_since_s_{0};
  ThreadHeartbeat heartbeat_;
  LatenessRecorder answers_;
  plumbline::Latest<motion_offset::CycleReport> reports_{1, motion_offset::CycleReport()};
  plumbline::Latest<status::MotionLinkStatus> status_{kStatusReaders, status::MotionLinkStatus()};
  mutable std::mutex problem_mutex_;
  std::string problem_;

  std::mutex model_mutex_;  ///< the link's thread only tries it
  std::shared_ptr<const motion_offset::MotionModel> next_model_;  ///< or the one to release
  bool model_waits_ = false;

  // Of the link's thread.
  MotionResponder responder_;
  std::unique_ptr<Arrival> next_, newest_;
  std::shared_ptr<const motion_offset::MotionModel> model_;
  bool others_ignored_ = false;
  double foreign_since_s_ = 0;  ///< begin of the second in which packets of others are counted
  std::uint64_t foreign_before_ = 0;
  bool no_socket_ = false;  ///< the latest attempt to open it failed
  std::uint64_t not_sent_ = 0;
  double longest_answer_s_ = 0;
};

}  // namespace plumbline::motion_link
