// Parsers for credentials and host in a request. Pure functions, fuzzed.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace plumbline::http {

/// Constant-time comparison: its duration reveals nothing about `secret` except its length.
bool SameSecret(std::string_view given, std::string_view secret);

/// Token of `Authorization: Bearer TOKEN` [RFC 6750, 2.1]; nullopt for another scheme or none.
std::optional<std::string_view> BearerToken(std::string_view authorization);

/// Value of the first cookie of that name in a Cookie header [RFC 6265, 5.4]; nullopt if there is
/// none.
std::optional<std::string_view> CookieOf(std::string_view header, std::string_view name);

/// The token's bytes in hexadecimal, since a cookie cannot contain every character of a token.
std::string CookieValueOf(std::string_view token);

/// Host of a Host header [RFC 9110, 7.2] in lower case, without port, an IPv6 address without
/// brackets; nullopt if malformed.
std::optional<std::string> HostOf(std::string_view header);

/// Protection against DNS rebinding, by which another site's name resolves to this computer: the
/// host must be an IP address, localhost or one of this computer's names.
bool IsOwnHost(std::string_view host, const std::vector<std::string>& own_names);

}  // namespace plumbline::http
