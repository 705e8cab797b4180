#include <arpa/inet.h>
#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "app/base/config/daemon_settings.h"
#include "app/base/config/page_token.h"

namespace plumbline::config {
namespace {

constexpr std::size_t kMinTokenLength = 16, kMaxTokenLength = 200;

bool IsHostName(const std::string& name) {
  return name.size() <= 253 && std::all_of(name.begin(), name.end(), [](unsigned char c) {
           return std::isalnum(c) != 0 || c == '-' || c == '.';
         });
}

void CheckToken(const TomlTable& table, const std::string& token) {
  const auto plain = [](char c) { return c > ' ' && c < 127; };
  // Faults go to the log, so this one must not contain the token.
  if (!token.empty() && (token.size() < kMinTokenLength || token.size() > kMaxTokenLength ||
                         !std::all_of(token.begin(), token.end(), plain))) {
    table.AddFault("",
                   fmt::format("token must consist of {}..{} printable ASCII characters without "
                               "spaces",
                               kMinTokenLength, kMaxTokenLength));
  }
  // HTTP header parsers decode %41 to A, so the token would never match.
  if (token.find('%') != std::string::npos) {
    table.AddFault("",
                   "token must not contain %, which HTTP headers decode; use another character");
  }
}

/// A warning, not a fault: the page must not keep the daemon, which reads the same file, from
/// starting.
void WarnAboutWeakToken(const TomlTable& table, const PageConfig& page) {
  if (page.token.empty() || IsLoopback(page.listen)) return;
  if (const auto why = WhyTokenWeak(page.token)) {
    table.AddWarning("", fmt::format("the page is not served: {}", *why));
  }
}

}  // namespace

bool IsLoopback(const std::string& address) {
  in_addr v4{};
  if (inet_pton(AF_INET, address.c_str(), &v4) == 1) return (ntohl(v4.s_addr) >> 24) == 127;
  in6_addr v6{};
  return inet_pton(AF_INET6, address.c_str(), &v6) == 1 && IN6_IS_ADDR_LOOPBACK(&v6);
}

bool IsWildcardAddress(const std::string& address) {
  return address == "0.0.0.0" || address == "::";
}

std::string PageUrl(const PageConfig& page, const std::string& own_name) {
  if (page.port.value_or(0) == 0 || IsLoopback(page.listen)) return "";
  std::string host = IsWildcardAddress(page.listen) ? own_name : page.listen;
  if (!page.hosts.empty()) host = page.hosts.front();
  if (host.find(':') != std::string::npos) host = "[" + host + "]";
  return host.empty() ? "" : fmt::format("http://{}:{}/", host, *page.port);
}

PageConfig PageFromToml(const TomlTable& table) {
  PageConfig page;
  ReadKeys(table, page);
  in6_addr address;
  const bool is_address = inet_pton(AF_INET, page.listen.c_str(), &address) == 1 ||
                          inet_pton(AF_INET6, page.listen.c_str(), &address) == 1;
  if (!is_address) {
    table.AddFault(
        "listen", "is not an IP address; write one such as 127.0.0.1, or 0.0.0.0 for all networks");
  }
  CheckToken(table, page.token);
  if (is_address && !IsLoopback(page.listen) && !table.Has("token")) {
    table.AddFault("listen",
                   "can be reached from other computers and therefore requires a token = \"...\"");
  }
  WarnAboutWeakToken(table, page);
  for (std::string& name : page.hosts) {
    if (!IsHostName(name)) {
      table.AddFault("hosts",
                     fmt::format("\"{}\" is not a host name such as cell7.plant.example", name));
    }
    for (char& c : name) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  return page;
}

}  // namespace plumbline::config
