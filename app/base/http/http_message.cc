#include "app/base/http/http_message.h"

#include <fmt/format.h>

#include <algorithm>

namespace plumbline::http {
namespace {

constexpr std::string_view kBlanks = " \t";

bool IsTokenCharacter(unsigned char c) {
  constexpr std::string_view kMarks = "!#$%&'*+-.^_`|~";  // [RFC 9110, 5.6.2]
  return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
         kMarks.find(static_cast<char>(c)) != std::string_view::npos;
}

bool IsToken(std::string_view text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), IsTokenCharacter);
}

bool IsControl(unsigned char c) {
  return c < 0x20 || c == 0x7F;
}

int HexDigit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

/// @return  nullopt if a percent escape is invalid or encodes a control character
std::optional<std::string> Decoded(std::string_view text, bool plus_is_space) {
  std::string decoded;
  for (std::size_t k = 0; k < text.size(); ++k) {
    char c = text[k];
    if (c == '+' && plus_is_space) c = ' ';
    if (c == '%') {
      if (text.size() - k < 3) return std::nullopt;
      const int high = HexDigit(text[k + 1]), low = HexDigit(text[k + 2]);
      if (high < 0 || low < 0) return std::nullopt;
      c = static_cast<char>(16 * high + low);
      k += 2;
    }
    if (IsControl(static_cast<unsigned char>(c))) return std::nullopt;
    decoded += c;
  }
  return decoded;
}

/// Removes and returns the text before a delimiter, or all of it; the delimiter is removed, too.
std::string_view Take(std::string_view& text, char delimiter) {
  const std::size_t end = std::min(text.find(delimiter), text.size());
  const std::string_view taken = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  return taken;
}

std::string_view TakeLine(std::string_view& text) {
  std::string_view line = Take(text, '\n');
  if (line.ends_with('\r')) line.remove_suffix(1);
  return line;
}

std::string_view Trimmed(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(kBlanks);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kBlanks) - begin + 1);
}

std::string Lowered(std::string_view text) {
  std::string lowered(text);
  std::transform(text.begin(), text.end(), lowered.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; });
  return lowered;
}

/// Sets path and parameters, and the host of an absolute target as sent to proxies.
/// @return  false if the target is invalid
bool ParseTarget(std::string_view target, HttpRequest& request) {
  constexpr std::string_view kScheme = "http://";
  target = target.substr(0, target.find('#'));
  if (Lowered(target.substr(0, kScheme.size())) == kScheme) {
    target.remove_prefix(kScheme.size());
    request.host = target.substr(0, target.find_first_of("/?"));
    if (request.host.empty()) return false;
    target.remove_prefix(request.host.size());
    if (target.empty()) target = "/";
  }
  if (!target.starts_with('/')) return false;
  const auto path = Decoded(Take(target, '?'), false);
  if (!path) return false;
  request.path = *path;
  while (!target.empty()) {
    std::string_view value = Take(target, '&');
    const auto name = Decoded(Take(value, '='), true), decoded = Decoded(value, true);
    if (!name || !decoded) return false;
    if (!name->empty()) request.parameters.emplace_back(*name, *decoded);
  }
  return true;
}

/// Value of the first field of that name; nullopt if there is none.
std::optional<std::string_view> ValueOf(const HttpFields& fields, std::string_view name) {
  for (const auto& [of, value] : fields) {
    if (of == name) return value;
  }
  return std::nullopt;
}

std::string_view ReasonOf(int status) {
  static constexpr std::pair<int, std::string_view> kReasons[] = {
      {200, "OK"},
      {303, "See Other"},
      {400, "Bad Request"},
      {401, "Unauthorized"},
      {404, "Not Found"},
      {405, "Method Not Allowed"},
      {408, "Request Timeout"},
      {413, "Content Too Large"},
      {421, "Misdirected Request"},
      {429, "Too Many Requests"},
      {431, "Request Header Fields Too Large"},
      {500, "Internal Server Error"},
      {503, "Service Unavailable"},
      {505, "HTTP Version Not Supported"},
  };
  for (const auto& [known, reason] : kReasons) {
    if (known == status) return reason;
  }
  return "";
}

}  // namespace

std::string_view HttpRequest::Header(std::string_view name) const {
  return ValueOf(headers, name).value_or("");
}

std::size_t HttpRequest::HeaderCount(std::string_view name) const {
  return static_cast<std::size_t>(std::count_if(
      headers.begin(), headers.end(), [name](const auto& field) { return field.first == name; }));
}

std::optional<std::string_view> HttpRequest::Parameter(std::string_view name) const {
  return ValueOf(parameters, name);
}

std::optional<std::size_t> EndOfHead(std::string_view bytes, std::size_t seen) {
  // The blank line may start within the last three bytes already seen.
  for (std::size_t at = bytes.find('\n', seen < 3 ? 0 : seen - 3); at != std::string_view::npos;
       at = bytes.find('\n', at + 1)) {
    const std::string_view rest = bytes.substr(at + 1);
    if (rest.starts_with('\n')) return at + 2;
    if (rest.starts_with("\r\n")) return at + 3;
  }
  return std::nullopt;
}

ParsedRequest ParseRequest(std::string_view head) {
  ParsedRequest parsed;
  HttpRequest& request = parsed.request;
  const auto refused = [&parsed](int status, const char* why) {
    parsed.refusal = status;
    parsed.why = why;
    return parsed;
  };
  std::string_view line = TakeLine(head);
  request.method = Take(line, ' ');
  const std::string_view target = Take(line, ' ');
  if (!IsToken(request.method) || target.empty() || !line.starts_with("HTTP/")) {
    return refused(400, "malformed request line");
  }
  if (line != "HTTP/1.1" && line != "HTTP/1.0") return refused(505, "use HTTP/1.1");
  if (request.method != "GET" && request.method != "HEAD") return parsed;
  if (!ParseTarget(target, request)) return refused(400, "malformed request target");
  for (line = TakeLine(head); !line.empty(); line = TakeLine(head)) {
    if (request.headers.size() == kMaxHeaders) return refused(431, "too many headers");
    std::string_view value = line;
    const std::string_view name = Take(value, ':');
    const bool has_value = name.size() < line.size();
    value = Trimmed(value);
    if (!has_value || !IsToken(name)) return refused(400, "malformed header");
    if (std::any_of(value.begin(), value.end(), [](char c) { return c != '\t' && IsControl(c); })) {
      return refused(400, "control character in a header");
    }
    request.headers.emplace_back(Lowered(name), value);
  }
  const bool has_body =
      std::any_of(request.headers.begin(), request.headers.end(), [](const auto& field) {
        return field.first == "transfer-encoding" ||
               (field.first == "content-length" && field.second != "0");
      });
  if (has_body) return refused(413, "request bodies are not accepted");
  if (request.host.empty() && request.HeaderCount("host") == 1)
    request.host = request.Header("host");
  return parsed;
}

void HttpResponse::Set(std::string_view name, std::string value) {
  const auto known = std::find_if(headers.begin(), headers.end(),
                                  [name](const auto& field) { return field.first == name; });
  if (known != headers.end()) {
    known->second = std::move(value);
  } else {
    headers.emplace_back(name, std::move(value));
  }
}

void HttpResponse::SetBody(std::string content, std::string_view type) {
  body = std::move(content);
  Set("Content-Type", std::string(type));
}

void HttpResponse::Refuse(int refusal, const std::string& why) {
  status = refusal;
  SetBody(why + "\n", "text/plain; charset=utf-8");
}

std::string HeadOf(const HttpResponse& response) {
  std::string head = fmt::format("HTTP/1.1 {} {}\r\nConnection: close\r\n", response.status,
                                 ReasonOf(response.status));
  for (const auto& [name, value] : response.headers) head += fmt::format("{}: {}\r\n", name, value);
  if (!response.stream) head += fmt::format("Content-Length: {}\r\n", response.body.size());
  return head + "\r\n";
}

}  // namespace plumbline::http
