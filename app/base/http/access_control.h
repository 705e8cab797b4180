// Access to a read-only site: method, host name and token of each request.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "app/base/http/authentication.h"
#include "app/base/http/http_message.h"
#include "drivers/os/tcp_listener.h"

namespace plumbline::http {

struct AccessOptions {
  std::string token;               ///< if empty, every request with a right host is admitted
  std::vector<std::string> hosts;  ///< names of this computer, besides the one it knows, lower case
  /// Called with the client's address after a wrong token, at most once a minute.
  std::function<void(const std::string& client)> on_wrong_token;
};

/// Serves the login page in place of "/" to whoever has no token; its files (/page.css, /login.js,
/// /icon.svg) are public. Thread-safe.
class AccessControl {
 public:
  explicit AccessControl(AccessOptions options);
  /// Call it before the first request: cookies are named after the port.
  void SetPort(int port) { authentication_.SetPort(port); }

  /// Sets the security headers. @return  whether the request may be answered; if not, the response
  /// is complete: a refusal, the login page, or a redirection that replaces the token by a cookie
  bool Admit(const HttpRequest& request, HttpResponse& response);
  std::uint64_t requests() const { return requests_; }
  std::uint64_t refused() const { return refused_; }

 private:
  /// Refuses the request if its address has to wait after too many wrong tokens, even if this token
  /// is right: the response must not reveal that.
  bool IsThrottled(const HttpRequest& request, const Credential& credential,
                   HttpResponse& response);
  void AskForToken(const HttpRequest& request, HttpResponse& response);
  void Refuse(HttpResponse& response, int status, const std::string& why);

  const AccessOptions options_;
  Authentication authentication_;
  std::vector<std::string> own_names_;
  std::atomic<std::uint64_t> requests_{0}, refused_{0};
  std::mutex failure_mutex_;
  double failure_reported_s_ = -1e300;
};

/// Why a site must not be served at an address that other computers reach: it has no token, or a
/// weak one; with the remedy. nullopt if it may be.
std::optional<std::string> WhyExposed(const os::TcpEndpoint& at, const std::string& token);

}  // namespace plumbline::http
