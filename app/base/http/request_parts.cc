#include "app/base/http/request_parts.h"

#include <arpa/inet.h>

#include <algorithm>

namespace plumbline::http {
namespace {

constexpr std::size_t kMaxHostLength = 253;

bool IsDigit(char c) {
  return c >= '0' && c <= '9';
}

bool IsLetter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}

char ToLower(char c) {
  return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
}

std::string_view TrimBlanks(std::string_view text) {
  const auto is_space = [](char c) { return c == ' ' || c == '\t'; };
  while (!text.empty() && is_space(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_space(text.back())) text.remove_suffix(1);
  return text;
}

bool IsAddress(const std::string& host) {
  if (host.find('\0') != std::string::npos) return false;  // inet_pton() would stop there
  in6_addr address;
  return inet_pton(AF_INET, host.c_str(), &address) == 1 ||
         inet_pton(AF_INET6, host.c_str(), &address) == 1;
}

bool IsPort(std::string_view text) {
  return text.size() <= 5 && std::all_of(text.begin(), text.end(), IsDigit);
}

}  // namespace

bool SameSecret(std::string_view given, std::string_view secret) {
  // Compare every byte, wherever the first difference is.
  unsigned difference = given.size() == secret.size() ? 0 : 1;
  for (std::size_t k = 0; k < given.size(); ++k) {
    const char other = secret.empty() ? '\0' : secret[k % secret.size()];
    difference |= static_cast<unsigned char>(given[k]) ^ static_cast<unsigned char>(other);
  }
  return difference == 0;
}

std::optional<std::string_view> BearerToken(std::string_view authorization) {
  constexpr std::string_view kScheme = "bearer ";
  authorization = TrimBlanks(authorization);
  if (authorization.size() <= kScheme.size()) return std::nullopt;
  for (std::size_t k = 0; k < kScheme.size(); ++k) {
    if (ToLower(authorization[k]) != kScheme[k]) return std::nullopt;
  }
  return TrimBlanks(authorization.substr(kScheme.size()));
}

std::optional<std::string_view> CookieOf(std::string_view header, std::string_view name) {
  while (!header.empty()) {
    const std::size_t end = std::min(header.find(';'), header.size());
    const std::string_view pair = TrimBlanks(header.substr(0, end));
    const std::size_t sign = pair.find('=');
    if (sign != std::string_view::npos && TrimBlanks(pair.substr(0, sign)) == name) {
      return TrimBlanks(pair.substr(sign + 1));
    }
    header.remove_prefix(std::min(end + 1, header.size()));
  }
  return std::nullopt;
}

std::string CookieValueOf(std::string_view token) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string value;
  for (const char c : token) {
    const auto byte = static_cast<unsigned char>(c);
    value += kDigits[byte >> 4U];
    value += kDigits[byte & 15U];
  }
  return value;
}

std::optional<std::string> HostOf(std::string_view header) {
  header = TrimBlanks(header);
  std::string_view host = header, rest;
  if (!header.empty() && header.front() == '[') {
    const std::size_t end = header.find(']');
    if (end == std::string_view::npos) return std::nullopt;
    host = header.substr(1, end - 1);
    rest = header.substr(end + 1);
    if (!IsAddress(std::string(host)) || host.find(':') == std::string_view::npos) {
      return std::nullopt;
    }
  } else {
    const std::size_t colon = std::min(header.find(':'), header.size());
    host = header.substr(0, colon);
    rest = header.substr(colon);
    const bool plain = std::all_of(host.begin(), host.end(), [](char c) {
      return IsLetter(c) || IsDigit(c) || c == '-' || c == '.' || c == '_';
    });
    if (!plain) return std::nullopt;
  }
  if (host.empty() || host.size() > kMaxHostLength) return std::nullopt;
  if (!rest.empty() && (rest.front() != ':' || !IsPort(rest.substr(1)))) return std::nullopt;
  std::string small(host);
  std::transform(small.begin(), small.end(), small.begin(), ToLower);
  return small;
}

bool IsOwnHost(std::string_view host, const std::vector<std::string>& own_names) {
  const std::string name(host);
  if (name == "localhost" || IsAddress(name)) return true;
  return std::find(own_names.begin(), own_names.end(), name) != own_names.end();
}

}  // namespace plumbline::http
