// Newest wall, read from the database once a second for all viewers.
#pragma once

#include <atomic>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "app/plant/page/wall.h"

namespace plumbline::plant {

/// Reads in a thread of its own until destroyed. A lost database is reported and retried. Other
/// methods are thread-safe.
class WallFeed {
 public:
  static constexpr double kPeriod_s = 1;
  /// Without an answer of the database for so long, the wall counts as old.
  static constexpr double kOld_s = 5;

  /// @param log  receives a line when the database is lost or answers again
  WallFeed(std::string settings, std::function<void(const std::string&)> log);
  ~WallFeed();
  WallFeed(const WallFeed&) = delete;
  WallFeed& operator=(const WallFeed&) = delete;

  struct Newest {
    std::shared_ptr<const Wall> wall;  ///< never null; version 0: none was read yet
    std::string problem;               ///< why it is old; empty if it is not
  };
  Newest Get() const;
  /// Waits for a version other than `version`, at most for `limit_s`.
  Newest Await(std::uint64_t version, double limit_s) const;

 private:
  void Run();
  Result<void> Read();
  std::string Problem() const;

  const std::string settings_;
  const std::function<void(const std::string&)> log_;
  std::optional<Connection> connection_;  ///< used by the thread only
  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  std::shared_ptr<const Wall> wall_ = std::make_shared<const Wall>();
  std::string failure_;  ///< of the last reading; empty if it succeeded
  double read_s_ = -1e300;
  bool ending_ = false;
  std::thread thread_;
};

}  // namespace plumbline::plant
