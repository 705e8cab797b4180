// Progress of a long-running command on standard error, and its interruption by a signal.
#pragma once

#include <condition_variable>
#include <csignal>
#include <functional>
#include <mutex>
#include <ostream>
#include <string>
#include <thread>

namespace plumbline::cli {

// Cooperative cancellation by SIGINT and SIGTERM for long-running commands.

/// While an object of this class exists, the first SIGINT or SIGTERM is only recorded, to be polled
/// with Requested(); a second one terminates the process. At most one object may exist at a time.
class Interruption {
 public:
  Interruption();
  ~Interruption();
  Interruption(const Interruption&) = delete;
  Interruption& operator=(const Interruption&) = delete;

  static bool Requested();

  /// Ignores both signals from now on, until the process ends or another Interruption is created.
  /// Call it before writing results: the exit code 130 promises that no file was changed.
  /// @return false if a signal has already arrived; nothing may be written then
  bool Disarm();

 private:
  bool disarmed_ = false;
  struct sigaction old_interrupt_ {};
  struct sigaction old_terminate_ {};
};

/// On a terminal, shows a single line after half a second and updates it every second; elsewhere,
/// prints a line every ten per cent, starting after two seconds. Both show the remaining time once
/// 5 % are done, extrapolated from the elapsed time.
class Progress {
 public:
  struct Display {
    int columns = 0;     ///< width of the terminal; 0 if there is none
    bool quiet = false;  ///< show nothing
    double update_s = 1;
    std::function<double()> clock_s;  ///< default: the monotonic clock
  };

  Progress(std::ostream& err, Display display);
  /// Uses the width of the terminal at standard error, or writes plain lines if it is not one.
  Progress(std::ostream& err, bool quiet);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// @param share  share that is done, 0..1
  /// @param doing  the current step: "fitting all rows"
  void Show(double share, const std::string& doing);
  /// "640 of 50000 poses".
  void ShowCount(std::size_t done, std::size_t of, const std::string& things);
  /// Erases the line on the terminal and shows nothing more. Call before printing anything else.
  void Clear();

 private:
  std::string Line() const;
  void ShowOnTerminal();
  void Update();

  std::ostream& err_;
  Display display_;
  double start_s_;
  double share_ = 0;
  std::string doing_;  ///< empty if there is nothing to show
  int last_percent_ = -1;
  std::string shown_;  ///< on the terminal
  bool ended_ = false;
  std::mutex mutex_;  ///< of all members above
  std::condition_variable end_;
  std::thread updater_;  ///< used on a terminal only
};

}  // namespace plumbline::cli
