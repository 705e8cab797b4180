#include "app/measure/report/certificate_text.h"

#include <fmt/format.h>

#include "app/measure/report/html.h"

namespace plumbline::measure {

std::string Shortened(const std::string& text, std::size_t most) {
  std::string valid = ValidUtf8(text);
  std::size_t characters = 0;
  for (std::size_t at = 0; at < valid.size(); ++at) {
    const bool starts = (static_cast<unsigned char>(valid[at]) & 0xC0) != 0x80;
    if (starts && ++characters > most) return valid.substr(0, at) + "\u2026";
  }
  return valid;
}

std::string CountText(std::size_t count, const char* what) {
  return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
}

}  // namespace plumbline::measure
