#include "app/base/text/visible.h"

#include <fmt/format.h>

#include <cstdint>

namespace plumbline::text {
namespace {

/// Length of the UTF-8 character at the start of the text, and its code; length 0 if there is none.
struct Character {
  std::size_t length = 0;
  std::uint32_t code = 0;
};

Character FirstCharacter(std::string_view text) {
  const auto byte = [&text](std::size_t k) { return static_cast<unsigned char>(text[k]); };
  const unsigned first = byte(0);
  if (first < 0x80) return {1, first};
  const std::size_t length = first >= 0xF0 ? 4 : first >= 0xE0 ? 3 : 2;
  if (first < 0xC2 || first > 0xF4 || text.size() < length) return {};
  std::uint32_t code = first & (0x7FU >> length);
  for (std::size_t k = 1; k < length; ++k) {
    if ((byte(k) & 0xC0U) != 0x80) return {};
    code = code << 6U | (byte(k) & 0x3FU);
  }
  constexpr std::uint32_t kSmallest[] = {0, 0, 0x80, 0x800, 0x10000};
  const bool surrogate = code >= 0xD800 && code <= 0xDFFF;
  return code < kSmallest[length] || code > 0x10FFFF || surrogate ? Character{}
                                                                  : Character{length, code};
}

bool IsExecuted(std::uint32_t code) {
  if (code < 0x20) return code != '\t' && code != '\n';
  return (code >= 0x7F && code < 0xA0) || code == 0x061C || code == 0x200E || code == 0x200F ||
         (code >= 0x2028 && code <= 0x202E) || (code >= 0x2066 && code <= 0x2069);
}

}  // namespace

std::string Visible(std::string_view text) {
  std::string visible;
  visible.reserve(text.size());
  while (!text.empty()) {
    const Character next = FirstCharacter(text);
    const std::size_t length = next.length == 0 ? 1 : next.length;
    if (next.length == 0) {
      visible += fmt::format("\\x{:02x}", static_cast<unsigned char>(text.front()));
    } else if (IsExecuted(next.code)) {
      visible += fmt::format("\\u{:04x}", next.code);
    } else {
      visible += text.substr(0, length);
    }
    text.remove_prefix(length);
  }
  return visible;
}

}  // namespace plumbline::text
