// HTTP/1.1 as the page speaks it: the head of a request, the head of an answer. Pure functions,
// fuzzed; what comes in parts, how long and how much is HttpServer's.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace plumbline {

/// Fields in their order, each a name and a value.
using HttpFields = std::vector<std::pair<std::string, std::string>>;

/// Of a method other than GET and HEAD only the method is filled in.
struct HttpRequest {
  std::string method;     ///< as sent: "GET"
  std::string host;       ///< with its port; empty: no Host header, or several
  std::string path;       ///< without the query, percent-decoded; begins with a slash
  HttpFields parameters;  ///< of the query, decoded
  HttpFields headers;     ///< names in small letters
  std::string peer;       ///< address of the other side

  /// The value of the first header of that name, in small letters; empty where there is none.
  std::string_view Header(std::string_view name) const;
  std::size_t HeaderCount(std::string_view name) const;
  /// The first of that name; nothing where there is none.
  std::optional<std::string_view> Parameter(std::string_view name) const;
};

constexpr std::size_t kMostHeaders = 100;

struct ParsedRequest {
  int refusal = 0;  ///< status of the answer that refuses the request; 0: it can be served
  std::string why;
  HttpRequest request;  ///< of a refused one what comes before the fault
};

/// Bytes up to the end of the blank line that ends a head [RFC 9112, 2.1]; nothing while it has not
/// come. A line may end without its carriage return [2.2].
/// @param seen  bytes that were searched before
std::optional<std::size_t> EndOfHead(std::string_view bytes, std::size_t seen = 0);

/// The request of a head that EndOfHead() delimited. Refused with status 400 are: a malformed
/// request line, a target that is neither a path nor http://host/path, an invalid percent escape, a
/// control character, a header without a name or folded over two lines; with 413 a request with a
/// body; with 431 more than kMostHeaders; with 505 a version other than 1.0 and 1.1. The host of an
/// absolute target takes precedence over the Host header [RFC 9112, 3.2.2].
ParsedRequest ParseRequest(std::string_view head);

/// Writes a part of a body. @return  false once the other side takes no more
using HttpWrite = std::function<bool(std::string_view)>;

struct HttpResponse {
  int status = 200;
  HttpFields headers;
  std::string body;
  /// In place of a body: called again and again while it returns true. It writes through its
  /// argument; an empty part asks whether the other side is still there.
  std::function<bool(const HttpWrite&)> stream;

  /// Sets a header, in place of an earlier one of the name.
  void Set(std::string_view name, std::string value);
  void SetBody(std::string content, std::string_view type);
  /// A line of plain text that says why there is nothing else.
  void Refuse(int refusal, const std::string& why);
};

/// Status line, headers and the blank line. Every answer ends its connection; one of a stream has
/// no length.
std::string HeadOf(const HttpResponse& response);

}  // namespace plumbline
