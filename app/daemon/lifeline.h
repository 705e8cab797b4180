// Whether every thread still comes round.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace plumbline {

/// Holds what is known of each thread's counter. Pure: time is an input. Used by one thread.
class Lifeline {
 public:
  /// @param beats       a counter that the thread raises whenever it comes round
  /// @param patience_s  longest time that it may stand still
  void Add(std::string thread, double patience_s, std::function<std::uint64_t()> beats);

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
    std::uint64_t seen = 0;
    double changed_s = 0;
    bool looked = false;
  };
  std::vector<Thread> threads_;
};

}  // namespace plumbline
