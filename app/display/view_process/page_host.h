// Host of the page: opens it if configured or socket-activated, and retries until it is served.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/base/config/daemon_config.h"
#include "app/display/page/page.h"
#include "drivers/os/descriptor.h"

namespace plumbline::display {

/// Logs to `sink` whether the page is served. A page that cannot be served affects nothing else; it
/// is retried every kRetry_s, since its address may come up with the network or its port become
/// free.
class PageHost {
 public:
  static constexpr double kRetry_s = 5;

  /// @param held  listening socket from the service manager, kept open; may be invalid
  /// @param port_file  receives the page's port whenever it is served; empty: none
  PageHost(display::DisplayMailbox& shown, os::Descriptor held, log::LogSink sink,
           std::string port_file = "")
      : shown_(shown),
        held_(std::move(held)),
        sink_(std::move(sink)),
        port_file_(std::move(port_file)) {}

  /// Called at start-up and after each reload. A page whose settings changed is closed and opened
  /// again; one that is not served is retried at once.
  void Open(const config::DaemonConfig& config);
  /// Called on every iteration of the view loop: collects log lines, or retries to serve the page.
  /// @param now_s  monotonic
  void Poll(double now_s);
  /// Null if none is served.
  const display::Page* page() const { return page_.get(); }

 private:
  /// Settings that the page depends on.
  struct Settings {
    config::PageConfig page;
    std::string state_directory;
    std::vector<model::Joint> joints;
  };
  static bool Same(const Settings& a, const Settings& b);
  void TryServe();

  display::DisplayMailbox& shown_;
  const os::Descriptor held_;
  const log::LogSink sink_;
  const std::string port_file_;
  std::optional<Settings> settings_;  ///< of the last Open()
  std::string problem_;               ///< last logged problem; empty if served or not configured
  double tried_s_ = -1e300;
  std::unique_ptr<display::Page> page_;
};

}  // namespace plumbline::display
