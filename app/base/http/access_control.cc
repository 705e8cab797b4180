#include "app/base/http/access_control.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "app/base/config/page_config.h"
#include "app/base/config/page_token.h"
#include "app/base/http/http_files.h"
#include "app/base/http/request_parts.h"
#include "drivers/clock.h"

namespace plumbline::http {
namespace {

constexpr double kFailureReportPeriod_s = 60;
/// Nothing from other origins, nothing inline, no framing.
constexpr const char* kPolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; connect-src 'self'; "
    "form-action 'self'; base-uri 'none'; frame-ancestors 'none'";

/// True for the files that the login page uses.
bool IsLoginFile(const std::string& path) {
  return path == "/page.css" || path == "/login.js" || path == "/icon.svg";
}

std::string LocalHostName() {
  char name[256] = "";
  gethostname(name, sizeof name - 1);
  std::string small(name);
  std::transform(small.begin(), small.end(), small.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return small;
}

}  // namespace

AccessControl::AccessControl(AccessOptions options)
    : options_(std::move(options)), authentication_(options_.token), own_names_(options_.hosts) {
  const std::string name = LocalHostName();
  own_names_.push_back(name);
  own_names_.push_back(name + ".local");
}

void AccessControl::Refuse(HttpResponse& response, int status, const std::string& why) {
  ++refused_;
  response.Refuse(status, why);
}

bool AccessControl::IsThrottled(const HttpRequest& request, const Credential& credential,
                                HttpResponse& response) {
  const double wait_s = authentication_.Attempt(request, credential, MonotonicSeconds());
  if (wait_s <= 0) return false;
  const auto whole_s = static_cast<int>(std::ceil(wait_s));
  Refuse(response, 429,
         fmt::format("too many wrong tokens from this address; try again in {} s", whole_s));
  response.Set("Retry-After", fmt::format("{}", whole_s));
  return true;
}

void AccessControl::AskForToken(const HttpRequest& request, HttpResponse& response) {
  const bool tried =
      request.HeaderCount("authorization") > 0 || request.Parameter("token").has_value();
  if (request.path == "/") {
    ++refused_;
    response.status = 401;
    response.SetBody(std::string(files::kLogin), kHtmlType);
  } else {
    Refuse(response, 401, "token required: send the header Authorization: Bearer TOKEN");
  }
  response.Set("WWW-Authenticate", "Bearer");
  if (!tried || !options_.on_wrong_token) return;
  const std::lock_guard lock(failure_mutex_);
  const double now_s = MonotonicSeconds();
  if (now_s - failure_reported_s_ < kFailureReportPeriod_s) return;
  failure_reported_s_ = now_s;
  options_.on_wrong_token(request.peer);
}

bool AccessControl::Admit(const HttpRequest& request, HttpResponse& response) {
  ++requests_;
  response.Set("Content-Security-Policy", kPolicy);
  response.Set("X-Content-Type-Options", "nosniff");
  response.Set("Referrer-Policy", "no-referrer");
  response.Set("Cross-Origin-Resource-Policy", "same-origin");
  response.Set("Cache-Control", "no-store");
  if (request.method != "GET" && request.method != "HEAD") {
    Refuse(response, 405, "this page is read-only: use GET or HEAD");
    response.Set("Allow", "GET, HEAD");
    return false;
  }
  const Credential credential = authentication_.CredentialOf(request);
  const auto host = HostOf(request.host);
  if (!host) {
    Refuse(response, 400, "missing or malformed Host header");
    return false;
  }
  if (!IsOwnHost(*host, own_names_)) {
    Refuse(response, 421,
           "unknown host name; if it is this computer's, add it to hosts under [page]");
    return false;
  }
  if (IsLoginFile(request.path)) return true;
  if (IsThrottled(request, credential, response)) return false;
  if (!credential.right) {
    AskForToken(request, response);
    return false;
  }
  if (!credential.in_address && request.path != "/login") return true;
  response.status = 303;
  response.Set("Location", "/");
  response.Set("Set-Cookie", authentication_.Cookie());
  return false;
}

std::optional<std::string> WhyExposed(const os::TcpEndpoint& at, const std::string& token) {
  if (config::IsLoopback(at.address)) return std::nullopt;
  if (token.empty()) {
    return fmt::format(
        "{} is reachable from other computers and needs a token: set token = \"...\" under [page]",
        at.Text());
  }
  const auto why = config::WhyTokenWeak(token);
  if (!why) return std::nullopt;
  return fmt::format("{} is reachable from other computers: {}", at.Text(), *why);
}

}  // namespace plumbline::http
