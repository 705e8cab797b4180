// HTTP/1.1 codec of the page: parses request heads, formats response heads. Pure functions, fuzzed;
// HttpConnection handles partial input and limits.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace plumbline::http {

/// Name-value pairs in their original order.
using HttpFields = std::vector<std::pair<std::string, std::string>>;

/// For methods other than GET and HEAD only `method` is set.
struct HttpRequest {
  std::string method;     ///< as sent: "GET"
  std::string host;       ///< with its port; empty without a Host header, or with several
  std::string path;       ///< without the query, percent-decoded; begins with a slash
  HttpFields parameters;  ///< of the query, decoded
  HttpFields headers;     ///< names in lower case
  std::string peer;       ///< client address

  /// Value of the first header of that name; empty if there is none.
  /// @param name  in lower case
  std::string_view Header(std::string_view name) const;
  std::size_t HeaderCount(std::string_view name) const;
  /// Value of the first parameter of that name; nullopt if there is none.
  std::optional<std::string_view> Parameter(std::string_view name) const;
};

constexpr std::size_t kMaxHeaders = 100;

struct ParsedRequest {
  int refusal = 0;  ///< HTTP status with which to refuse the request; 0 if it can be served
  std::string why;
  HttpRequest request;  ///< if refused, what was parsed before the fault
};

/// Length of a head including its blank line [RFC 9112, 2.1]; nullopt if it is incomplete. A line
/// may end without a carriage return [2.2].
/// @param seen  number of bytes already searched
std::optional<std::size_t> EndOfHead(std::string_view bytes, std::size_t seen = 0);

/// Parses a head delimited by EndOfHead(). Refuses with 400 a malformed request line, a target that
/// is neither a path nor http://host/path, an invalid percent escape, a control character, a header
/// without a name or folded over two lines; with 413 a request with a body; with 431 more than
/// kMaxHeaders headers; with 505 a version other than 1.0 and 1.1. The host of an absolute target
/// takes precedence over the Host header [RFC 9112, 3.2.2].
ParsedRequest ParseRequest(std::string_view head);

/// Writes a part of a body. @return  false once the client takes no more
using HttpWrite = std::function<bool(std::string_view)>;

struct HttpResponse {
  int status = 200;
  HttpFields headers;
  std::string body;
  /// Streaming alternative to `body`: called repeatedly while it returns true. It writes through
  /// its argument; writing an empty part checks whether the client is still connected.
  std::function<bool(const HttpWrite&)> stream;

  /// Sets a header, replacing an earlier one of the same name.
  void Set(std::string_view name, std::string value);
  void SetBody(std::string content, std::string_view type);
  /// Sets status and a one-line plain-text body.
  void Refuse(int refusal, const std::string& why);
};

/// Status line, headers and blank line. Each response closes its connection; a stream has no
/// Content-Length.
std::string HeadOf(const HttpResponse& response);

}  // namespace plumbline::http
