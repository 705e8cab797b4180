// The page: what plumbline-view tells a browser, Prometheus, or a script. To look only.
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "app/config/page_config.h"
#include "app/log/log_entry.h"
#include "app/page/guess_limit.h"
#include "app/page/http_server.h"
#include "app/page/log_tail.h"
#include "app/page/metrics.h"
#include "app/page/picture_feed.h"
#include "drivers/os/descriptor.h"
#include "firmware-like/model/cell_model.h"

namespace plumbline {

struct PageOptions {
  PageConfig config;
  std::string state_directory;
  std::vector<Joint> joints;  ///< of the cell, for the journal's rows
  ConnectionLimits limits;
};

/// Text that is made anew at most every so often, however many ask.
class KeptText {
 public:
  std::string Get(double now_s, double period_s, const std::function<std::string()>& make);

 private:
  std::mutex mutex_;
  double made_s_ = -1e300;
  std::string text_;
};

/// Serves until it is destroyed; several threads. Everything but the login's three files asks for
/// the token where there is one.
class Page {
 public:
  static constexpr int kMostViewers = 8;  ///< of the live picture

  /// @param listener  of the service manager; none: the page opens a socket of its own
  /// @return          or why it is not served, with a remedy: the port, or no token though other
  ///                  computers reach the socket
  static Result<std::unique_ptr<Page>> Start(PageOptions options, Shown& shown, LogSink sink,
                                             Descriptor listener = {});

  const TcpEndpoint& at() const { return at_; }

  /// Gathers the messages of the newest state; where states arrive, also while nobody looks.
  void Remember();

  /// Fills in the answer to one request; what the server's threads call.
  void Answer(const HttpRequest& request, HttpResponse& response);

 private:
  Page(PageOptions options, Shown& shown, LogSink sink);
  /// The token, or the cookie in place of it, that a request gives; and whether it is ours.
  struct Given {
    bool in_address = false;  ///< `?token=`
    bool right = false;
    std::string text;  ///< empty: nothing was given
  };
  Given WhatIsGiven(const HttpRequest& request) const;
  Given WhatHeadersGive(const HttpRequest& request) const;
  /// After too many wrong tokens of its address; a right one is told nothing else then.
  bool HasToWait(const HttpRequest& request, const Given& given, HttpResponse& response);
  void AskForToken(const HttpRequest& request, HttpResponse& response);
  void Exchange(HttpResponse& response) const;
  void AnswerKnown(const HttpRequest& request, HttpResponse& response);
  void AnswerLive(HttpResponse& response);
  void AnswerReport(const std::string& name, HttpResponse& response) const;
  void Refuse(HttpResponse& response, int status, const std::string& why);
  std::string Status();
  std::string Reports() const;
  std::string Metrics(double now_s) const;
  void Health(HttpResponse& response) const;

  const PageOptions options_;
  const LogSink sink_;
  const std::string cookie_value_;
  Shown& shown_;
  PictureFeed feed_;
  LogTail log_;
  std::shared_ptr<const ShownNow> remembered_;  ///< of the thread that calls Remember()
  KeptText trend_, reports_;
  std::vector<std::string> own_names_;
  TcpEndpoint at_;
  std::string cookie_name_;
  const std::string start_;  ///< another one with every start
  std::atomic<std::uint64_t> requests_{0}, refused_{0};
  std::atomic<int> viewers_{0};
  GuessLimit guesses_;
  std::mutex told_mutex_;
  double told_s_ = -1e300;
  std::unique_ptr<HttpServer> server_;  ///< goes first: its threads use the rest
};

}  // namespace plumbline
