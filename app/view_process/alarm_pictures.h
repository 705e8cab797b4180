// The last pictures before an alarm, and the first after it, kept as files.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

#include "app/log/log_entry.h"
#include "drivers/display/picture.h"

namespace plumbline {

/// How many pictures of alarms are kept; the oldest go first.
struct AlarmPictureLimits {
  std::size_t files = 60;
  std::uint64_t bytes = std::uint64_t{100} << 20;
};

/// Files in `folder`: alarm-UTC-WORD-N.png, WORD the alarm bits, N counting from the oldest. A
/// thread of their own compresses what is remembered (a sixth of the memory), and writes the files.
class AlarmPictures {
 public:
  static constexpr double kPeriod_s = 1.0;  ///< from one remembered picture to the next
  static constexpr std::size_t kBefore = 3;

  AlarmPictures(std::string folder, AlarmPictureLimits limits, LogSink sink);
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
  /// A picture, or an alarm.
  struct Job {
    RgbImage picture;
    bool after_alarm = false;  ///< the picture is the first after one
    std::string name;          ///< of the alarm's files; empty: a picture
  };
  /// Whether it is taken; told where it is not.
  bool Give(Job job);
  void Run();
  void Do(const Job& job);
  void Write(const std::string& png);
  void MakeRoom() const;

  const std::string folder_;
  const AlarmPictureLimits limits_;
  const LogSink sink_;
  double remembered_s_ = -1e300;
  std::uint16_t alarms_ = 0;
  bool observed_ = false;
  bool after_alarm_ = false;

  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<Job> jobs_;
  bool end_ = false;

  // The thread's own.
  std::deque<std::string> remembered_;  ///< as PNG
  std::string name_;                    ///< of the present alarm's files
  int number_ = 0;
  std::thread thread_;
};

}  // namespace plumbline
