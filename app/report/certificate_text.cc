#include "app/report/certificate_text.h"

#include <fmt/format.h>

#include "app/report/html.h"

namespace plumbline::report {

std::string Shortened(const std::string& text, std::size_t most) {
  const std::string valid = ValidUtf8(text);
  if (valid.size() <= most) return valid;
  std::size_t end = most;
  while (end > 0 && (static_cast<unsigned char>(valid[end]) & 0xC0) == 0x80) --end;
  return valid.substr(0, end) + "\u2026";
}

std::string CountText(std::size_t count, const char* what) {
  return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
}

}  // namespace plumbline::report
