// Recorder of the last pictures before an alarm and the first after it, as files.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

#include "app/base/log/log_entry.h"
#include "drivers/display/picture.h"

namespace plumbline::display {

/// Limits on the stored alarm pictures; the oldest are deleted first.
struct AlarmPictureLimits {
  std::size_t files = 60;
  std::uint64_t bytes = std::uint64_t{100} << 20;
};

/// Writes alarm-UTC-WORD-N.png to `folder`, with WORD the alarm word in hexadecimal and N counted
/// from the oldest picture. A background thread compresses the remembered pictures to a sixth of
/// their size and writes the files.
class AlarmPictures {
 public:
  static constexpr double kPeriod_s = 1.0;  ///< from one remembered picture to the next
  static constexpr std::size_t kBefore = 3;

  AlarmPictures(std::string folder, AlarmPictureLimits limits, log::LogSink sink);
  ~AlarmPictures();
  AlarmPictures(const AlarmPictures&) = delete;
  AlarmPictures& operator=(const AlarmPictures&) = delete;

  /// Whether the picture that is being drawn should be passed to Remember().
  bool Due(double now_s) const { return after_alarm_ || now_s - remembered_s_ >= kPeriod_s; }
  void Remember(display::RgbImage picture, double now_s);

  /// Takes the alarm word of the newest state. A newly set bit stores the remembered pictures and
  /// the next one.
  void Observe(std::uint16_t alarms, double utc_s);

 private:
  /// Either a picture to remember or an alarm to store.
  struct Job {
    display::RgbImage picture;
    bool after_alarm = false;  ///< the first picture after an alarm
    std::string name;          ///< base name of the alarm's files; empty: a picture
  };
  /// @return  false if the queue is full; a rejected alarm is logged
  bool Enqueue(Job job);
  void Run();
  void Process(const Job& job);
  void Write(const std::string& png);
  void DeleteOldest() const;

  const std::string folder_;
  const AlarmPictureLimits limits_;
  const log::LogSink sink_;
  double remembered_s_ = -1e300;
  std::uint16_t alarms_ = 0;
  bool observed_ = false;
  bool after_alarm_ = false;

  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<Job> jobs_;
  bool end_ = false;

  // Accessed by thread_ only.
  std::deque<std::string> remembered_;  ///< as PNG
  std::string name_;                    ///< base name of the present alarm's files
  int number_ = 0;
  std::thread thread_;
};

}  // namespace plumbline::display
