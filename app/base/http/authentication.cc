#include "app/base/http/authentication.h"

#include <fmt/format.h>

#include <functional>
#include <utility>

#include "app/base/http/request_parts.h"

namespace plumbline::http {
namespace {

constexpr int kCookieLifetime_s = 30 * 86400;

}  // namespace

Authentication::Authentication(std::string token)
    : token_(std::move(token)), cookie_value_(CookieValueOf(token_)) {}

void Authentication::SetPort(int port) {
  cookie_name_ = fmt::format("plumbline-{}", port);
}

Credential Authentication::CredentialOf(const HttpRequest& request) const {
  if (token_.empty()) return {false, true, ""};
  const auto parameter = request.Parameter("token");
  const bool in_address = parameter.has_value();
  const std::string text(parameter.value_or(""));
  if (in_address && SameSecret(text, token_)) return {true, true, text};
  const Credential in_header = CredentialInHeaders(request);
  return in_address && !in_header.right ? Credential{true, false, text} : in_header;
}

Credential Authentication::CredentialInHeaders(const HttpRequest& request) const {
  const auto bearer = request.Header("authorization");
  if (const auto credential = BearerToken(bearer)) {
    return {false, SameSecret(*credential, token_), std::string(*credential)};
  }
  const auto cookies = request.Header("cookie");
  if (const auto cookie = CookieOf(cookies, cookie_name_)) {
    return {false, SameSecret(*cookie, cookie_value_), std::string(*cookie)};
  }
  return {};
}

double Authentication::Attempt(const HttpRequest& request, const Credential& credential,
                               double now_s) {
  if (credential.text.empty()) return 0;
  const double wait_s = throttle_.Wait_s(request.peer, now_s);
  if (wait_s > 0) return wait_s;
  if (credential.right) {
    throttle_.Succeeded(request.peer);
  } else {
    throttle_.Failed(request.peer, std::hash<std::string>()(credential.text), now_s);
  }
  return 0;
}

std::string Authentication::Cookie() const {
  return fmt::format("{}={}; Path=/; Max-Age={}; HttpOnly; SameSite=Strict", cookie_name_,
                     cookie_value_, kCookieLifetime_s);
}

}  // namespace plumbline::http
