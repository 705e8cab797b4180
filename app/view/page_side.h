// The page of this process, where one is configured or the service manager holds its port.
#pragma once

#include <memory>
#include <optional>

#include "app/config/daemon_config.h"
#include "app/page/page.h"

namespace plumbline {

/// What becomes of the page is told to `sink`; a page that cannot be served stops nothing else.
class PageSide {
 public:
  /// @param held_fd  the service manager's listening socket, kept open; -1: none
  PageSide(Shown& shown, int held_fd, Page::Sink sink)
      : shown_(shown), held_fd_(held_fd), sink_(std::move(sink)) {}

  /// At the start, and again when the configuration was read anew: a page that changes is closed
  /// and opened.
  void Open(const DaemonConfig& config);

 private:
  void WarnOfReaders(const DaemonConfig& config) const;

  Shown& shown_;
  const int held_fd_;
  const Page::Sink sink_;
  std::optional<PageConfig> config_;  ///< of the last Open()
  std::unique_ptr<Page> page_;
};

}  // namespace plumbline
