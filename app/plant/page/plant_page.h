// Read-only page of the plant for browsers: a wall of its cells by health.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "app/base/config/page_config.h"
#include "app/base/http/access_control.h"
#include "app/base/http/http_server.h"
#include "app/plant/page/wall_feed.h"
#include "drivers/os/descriptor.h"

namespace plumbline::plant {

struct PlantPageOptions {
  config::PageConfig page;
  std::string database;  ///< libpq connection string
  std::function<void(const std::string&)> log;
};

/// Serves from threads of its own until destroyed.
class PlantPage {
 public:
  /// Open streams of changes; further browsers ask once a second instead. Fewer than the server's
  /// connections, so that the page itself can still be loaded.
  static constexpr int kMaxStreams = 20, kMaxStreamsPerPeer = 8;

  /// @param listener  socket from the service manager; invalid: the page opens its own
  /// @return          the page, or why it cannot be served, with a remedy
  /// @param faulty    set to true if only another configuration helps
  static Result<std::unique_ptr<PlantPage>> Start(PlantPageOptions options,
                                                  os::Descriptor listener = {},
                                                  bool* faulty = nullptr);

  const os::TcpEndpoint& at() const { return at_; }
  /// Fills in the response to one request; called by the server's threads.
  void Answer(const http::HttpRequest& request, http::HttpResponse& response);

 private:
  explicit PlantPage(PlantPageOptions options);
  void AnswerWall(const http::HttpRequest& request, http::HttpResponse& response) const;
  void AnswerEvents(const http::HttpRequest& request, http::HttpResponse& response);
  std::uint64_t VersionOf(const http::HttpRequest& request) const;

  const std::string start_;  ///< identifies this run
  http::AccessControl access_;
  std::mutex streams_mutex_;
  std::map<std::string, int> streams_;  ///< by address of the client
  WallFeed feed_;
  os::TcpEndpoint at_;
  std::unique_ptr<http::HttpServer> server_;  ///< destroyed first: its threads use the others
};

}  // namespace plumbline::plant
