// Whether every thread still comes round, or waits for a device.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace plumbline {

/// Holds what is known of each thread's counter. Pure: time is an input. Used by one thread.
class Lifeline {
 public:
  /// For how long a thread may wait for a device: a disk's retries, a USB camera's time-outs.
  /// Nothing is won by a restart meanwhile: the kernel does not let go of such a thread.
  static constexpr double kDevicePatience_s = 30;

  /// @param beats       a counter that the thread raises whenever it comes round
  /// @param patience_s  longest time that it may stand still otherwise
  /// @param waits       whether it waits for a device now; asked only of one that is late
  void Add(
      std::string thread, double patience_s, std::function<std::uint64_t()> beats,
      std::function<bool()> waits = [] { return false; });

  /// Of a thread that was added: what it does may take another time from now on.
  void SetPatience(const std::string& thread, double patience_s);

  /// @return  the first thread that stands still, and for how long [s]; its name is empty where all
  ///          come round
  struct Standing {
    std::string thread;
    double for_s = 0;
  };
  Standing Look(double now_s);

 private:
  struct Thread {
    std::string name;
    double patience_s;
    std::function<std::uint64_t()> beats;
    std::function<bool()> waits;
    std::uint64_t seen = 0;
    double changed_s = 0;  ///< when it came round last
    double excused_s = 0;  ///< when it did, or was last seen to wait for a device
    bool looked = false;
  };
  std::vector<Thread> threads_;
};

}  // namespace plumbline
