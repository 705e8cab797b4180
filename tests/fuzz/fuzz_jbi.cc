// Fuzzer: arbitrary bytes as a Yaskawa job and as its tools: numbers where they are written, never
// a crash.
#include <cstdint>

#include "app/programs/brands/jbi.h"
#include "tests/fuzz/program_checks.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  const auto zero = std::min(bytes.find('\0'), bytes.size());
  CheckReading(plumbline::programs::YaskawaJbi(),
               {{"A.JBI", "/JOB" + bytes.substr(0, zero)},
                {"TOOL.CND", "//TOOL " + bytes.substr(std::min(zero + 1, bytes.size()))}});
  return 0;
}
