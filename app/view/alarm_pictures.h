// The last pictures before an alarm, and the first after it, kept as files.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

#include "drivers/display/picture.h"

namespace plumbline {

/// How many pictures of alarms are kept; the oldest go first.
struct AlarmPictureLimits {
  std::size_t files = 60;
  std::uint64_t bytes = std::uint64_t{100} << 20;
};

/// Files in `folder`: alarm-UTC-WORD-N.png, WORD the alarm bits, N counting from the oldest. They
/// are written by a thread of their own.
class AlarmPictures {
 public:
  static constexpr double kPeriod_s = 1.0;  ///< from one remembered picture to the next
  static constexpr std::size_t kBefore = 3;

  using Sink = std::function<void(bool bad, const std::string&)>;
  AlarmPictures(std::string folder, AlarmPictureLimits limits, Sink sink);
  ~AlarmPictures();
  AlarmPictures(const AlarmPictures&) = delete;
  AlarmPictures& operator=(const AlarmPictures&) = delete;

  /// Whether the picture that is being drawn should be given to Remember().
  bool Due(double now_s) const { return after_alarm_ || now_s - remembered_s_ >= kPeriod_s; }
  void Remember(RgbImage picture, double now_s);

  /// The alarm word of the newest state: a bit that was not set before keeps what is remembered,
  /// and the next picture.
  void Observe(std::uint16_t alarms, double utc_s);

 private:
  struct Job {
    std::string name;
    RgbImage picture;
  };
  void Keep(RgbImage picture);
  void Run();
  void MakeRoom() const;

  const std::string folder_;
  const AlarmPictureLimits limits_;
  const Sink sink_;
  std::deque<RgbImage> remembered_;
  double remembered_s_ = -1e300;
  std::uint16_t alarms_ = 0;
  bool observed_ = false;
  bool after_alarm_ = false;
  std::string name_;  ///< of the present alarm's files
  int number_ = 0;

  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<Job> jobs_;
  bool end_ = false;
  std::thread thread_;
};

}  // namespace plumbline
