#include "app/cli/status_line.h"

#include <fmt/format.h>

namespace plumbline::cli {

void PrintStatusLine(std::ostream& out, std::string_view topic, std::string_view text) {
  out << fmt::format("{:<12} {}\n", topic, text);
}

std::string BitsText(int word, std::span<const plc::BitMeaning> bits) {
  if (word == 0) return "none";
  std::string text = fmt::format("0x{:04X}:", word);
  const char* separator = " ";
  for (const plc::BitMeaning& bit : bits) {
    if ((word & bit.mask) == 0) continue;
    text += separator + std::string(bit.meaning);
    separator = ", ";
  }
  return text;
}

}  // namespace plumbline::cli
