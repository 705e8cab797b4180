// Read-only status page of plumbline-view for browsers, Prometheus and scripts.
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "app/base/config/page_config.h"
#include "app/base/http/access_control.h"
#include "app/base/http/http_server.h"
#include "app/base/log/log_entry.h"
#include "app/display/page/log_tail.h"
#include "app/display/page/metrics.h"
#include "app/display/page/picture_feed.h"
#include "drivers/camera/v4l2_device.h"
#include "drivers/os/descriptor.h"
#include "firmware-like/model/cell_model.h"

namespace plumbline::display {

// The cameras of this computer with the command that chooses one, for the page's commissioning
// view.

/// The cameras behind the video nodes as JSON: {"cameras": [{"name", "device", "select", "serial",
/// "port", "command"}]}. Several nodes of one camera are listed once. `command` prints the lines of
/// plumbline.toml that select the camera; it is null if the camera's name contains characters that
/// a shell interprets, since names come from the device and the command is made to be pasted.
/// @param nodes  as ListVideoNodes() returns them
std::string CameraListJson(const std::vector<camera::V4l2Device>& nodes);

struct PageOptions {
  config::PageConfig config;
  std::string state_directory;
  std::vector<model::Joint> joints;  ///< the cell's joints, to read the journal
  camera::DeviceTree cameras;        ///< the kernel's video devices
  http::ConnectionLimits limits;
};

/// Text that is recomputed at most once per period, whatever the number of requests. Thread-safe.
class CachedText {
 public:
  std::string Get(double now_s, double period_s, const std::function<std::string()>& make);

 private:
  std::mutex mutex_;
  double made_s_ = -1e300;
  std::string text_;
};

/// Serves from threads of its own until destroyed. If a token is configured, everything except the
/// three files of the login page requires it.
class Page {
 public:
  static constexpr int kMaxViewers = 8;  ///< of the live picture

  /// @param listener  socket from the service manager; invalid: the page opens its own
  /// @return          the page, or why it cannot be served, with a remedy
  static Result<std::unique_ptr<Page>> Start(PageOptions options, display::DisplayMailbox& shown,
                                             log::LogSink sink, os::Descriptor listener = {});

  const os::TcpEndpoint& at() const { return at_; }

  /// Collects the log lines of the newest status. Call it regularly, also without viewers.
  void CollectLog();

  /// Fills in the response to one request; called by the server's threads.
  void Answer(const http::HttpRequest& request, http::HttpResponse& response);

 private:
  Page(PageOptions options, display::DisplayMailbox& shown, log::LogSink sink);
  void AnswerAuthorized(const http::HttpRequest& request, http::HttpResponse& response);
  void AnswerLive(http::HttpResponse& response);
  void AnswerReport(const std::string& name, http::HttpResponse& response) const;
  void Refuse(http::HttpResponse& response, int status, const std::string& why);
  std::string Status();
  std::string Reports() const;
  std::string MetricsResponse(double now_s) const;
  void AnswerHealth(http::HttpResponse& response) const;

  const PageOptions options_;
  const log::LogSink sink_;
  http::AccessControl access_;
  display::DisplayMailbox& shown_;
  PictureFeed feed_;
  LogTail log_;
  std::shared_ptr<const display::DisplayStatus> collected_;  ///< used by CollectLog() only
  CachedText trend_, reports_, cameras_;
  os::TcpEndpoint at_;
  const std::string start_id_;             ///< unique for each start of the page
  std::atomic<std::uint64_t> refused_{0};  ///< after they were admitted
  std::atomic<int> viewers_{0};
  std::unique_ptr<http::HttpServer>
      server_;  ///< destroyed first: its threads use the other members
};

}  // namespace plumbline::display
