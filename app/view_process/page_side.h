// The page of this process, where one is configured or the service manager holds its port.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/config/daemon_config.h"
#include "app/page/page.h"
#include "drivers/os/descriptor.h"

namespace plumbline {

/// What becomes of the page is told to `sink`; a page that cannot be served stops nothing else, and
/// is tried again every kRetry_s: its address may come with the network, its port may become free.
class PageSide {
 public:
  static constexpr double kRetry_s = 5;

  /// @param held  the service manager's listening socket, kept open; or none
  PageSide(Shown& shown, Descriptor held, LogSink sink)
      : shown_(shown), held_(std::move(held)), sink_(std::move(sink)) {}

  /// At the start, and again when the configuration was read anew: a page that changes is closed
  /// and opened, one that is not served is tried at once.
  void Open(const DaemonConfig& config);
  /// Of the loop, whenever it comes round: gathers messages, or tries again. @param now_s monotonic
  void Round(double now_s);
  /// Null: none is served.
  const Page* page() const { return page_.get(); }

 private:
  /// What a page is made of.
  struct Used {
    PageConfig page;
    std::string state_directory;
    std::vector<Joint> joints;
  };
  static bool Same(const Used& a, const Used& b);
  void Try();
  void WarnOfReaders() const;

  Shown& shown_;
  const Descriptor held_;
  const LogSink sink_;
  std::optional<Used> used_;  ///< of the last Open()
  std::string file_;          ///< of the configuration
  std::string problem_;       ///< that was told; empty: it is served, or not wanted
  double tried_s_ = -1e300;
  std::unique_ptr<Page> page_;
};

}  // namespace plumbline
