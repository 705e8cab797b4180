#include "app/base/text/utc_text.h"

#include <cmath>
#include <ctime>

namespace plumbline::text {

std::string TextFromUtc(double utc_s) {
  const auto seconds = static_cast<std::time_t>(std::floor(utc_s));
  std::tm parts{};
  gmtime_r(&seconds, &parts);
  char text[32];
  return {text, std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &parts)};
}

std::string TextOfUtcNow() {
  return TextFromUtc(static_cast<double>(std::time(nullptr)));
}

std::optional<double> UtcFromText(const std::string& text) {
  std::tm parts{};
  const char* const end = strptime(text.c_str(), "%Y-%m-%dT%H:%M:%SZ", &parts);
  if (end == nullptr || *end != '\0') return std::nullopt;
  const auto utc_s = static_cast<double>(timegm(&parts));
  if (TextFromUtc(utc_s) != text) return std::nullopt;  // a date that does not exist
  return utc_s;
}

}  // namespace plumbline::text
