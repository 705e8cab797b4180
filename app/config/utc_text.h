// UTC as files tell it.
#pragma once

#include <optional>
#include <string>

namespace plumbline {

/// "2026-11-21T07:30:00Z" of seconds since 1970, a fraction left out.
std::string TextFromUtc(double utc_s);

/// Seconds since 1970 of such a text; nothing where it is none.
std::optional<double> UtcFromText(const std::string& text);

}  // namespace plumbline
