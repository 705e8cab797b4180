// Authentication of requests by a token, with a rate limit on wrong ones.
#pragma once

#include <string>

#include "app/base/http/http_message.h"
#include "app/base/http/login_throttle.h"

namespace plumbline::http {

/// Token or cookie sent with a request.
struct Credential {
  bool in_address = false;  ///< sent as `?token=`
  bool right = false;
  std::string text;  ///< empty: none was sent
};

class Authentication {
 public:
  /// @param token  if empty, every request is admitted
  explicit Authentication(std::string token);
  /// Cookies are shared between all ports of a host, so their name contains the port. Call it
  /// before the first request.
  void SetPort(int port);

  /// The token in the address or in a header, or the cookie; a right one is preferred.
  Credential CredentialOf(const HttpRequest& request) const;

  /// Counts an attempt against the limit of the client's address. Thread-safe.
  /// @return  time for which the address has to wait after too many wrong tokens [s], even if this
  ///          token is right, because the response must not reveal that; 0 if it need not wait
  double Attempt(const HttpRequest& request, const Credential& credential, double now_s);

  /// Value of Set-Cookie that replaces the token.
  std::string Cookie() const;

 private:
  Credential CredentialInHeaders(const HttpRequest& request) const;

  const std::string token_, cookie_value_;
  std::string cookie_name_;
  LoginThrottle throttle_;
};

}  // namespace plumbline::http
