// What a browser sends, taken apart: pure functions, fuzzed.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace plumbline {

/// Whether both are the same, in a time that tells nothing about `secret` but its length.
bool SameSecret(std::string_view given, std::string_view secret);

/// The token of `Authorization: Bearer TOKEN` [RFC 6750, 2.1]; nothing: another scheme, or none.
std::optional<std::string_view> BearerOf(std::string_view authorization);

/// The value of the cookie `name` in a Cookie header [RFC 6265, 5.4]; the first where there are
/// several; nothing: none.
std::optional<std::string_view> CookieOf(std::string_view header, std::string_view name);

/// A token's bytes in hexadecimal digits: any character may stand in a token, not in a cookie.
std::string CookieValueOf(std::string_view token);

/// The host of a Host header in small letters, without its port, an IPv6 address without its
/// brackets; nothing: it is none [RFC 9110, 7.2].
std::optional<std::string> HostOf(std::string_view header);

/// Against DNS rebinding, by which another site's name leads a browser here: a request must name an
/// address, localhost, or a name that this computer is known by. An address cannot be rebound.
bool IsOwnHost(std::string_view host, const std::vector<std::string>& own_names);

/// What kind of report a name of /reports/ stands for, and so the folder that it lies in.
enum class ReportKind { kNone, kModel, kDiagnosis, kAlarmPicture };

/// `0007.html` of a model version (at least four digits), `diagnosis.html`, `alarm-*.png`; only
/// letters, digits, '-' and single dots stand in those, so that no name leaves its folder.
ReportKind ReportKindOf(std::string_view name);

}  // namespace plumbline
