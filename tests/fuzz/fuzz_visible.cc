// Fuzzer: arbitrary bytes as text that a command prints: nothing that a terminal executes remains.
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "app/base/text/text.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const std::string visible = plumbline::text::Visible(text);
  for (std::size_t k = 0; k < visible.size(); ++k) {
    const auto byte = static_cast<unsigned char>(visible[k]);
    if ((byte < 0x20 && byte != '\t' && byte != '\n') || byte == 0x7F) std::abort();
    if (byte == 0xC2 && static_cast<unsigned char>(visible[k + 1]) < 0xA0) std::abort();  // C1
  }
  if (plumbline::text::Visible(visible) != visible) std::abort();  // it is valid UTF-8
  return 0;
}
