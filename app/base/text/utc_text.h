// UTC timestamps as text, ISO 8601.
#pragma once

#include <optional>
#include <string>

namespace plumbline::text {

/// "2026-11-21T07:30:00Z" from seconds since 1970, rounded down to a full second.
std::string TextFromUtc(double utc_s);

/// The same for the current time.
std::string TextOfUtcNow();

/// Seconds since 1970, or nullopt if the text does not have this form.
std::optional<double> UtcFromText(const std::string& text);

}  // namespace plumbline::text
