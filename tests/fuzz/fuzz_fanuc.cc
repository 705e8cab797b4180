// Fuzzer: arbitrary bytes as a FANUC listing beside a listing of system variables, and as a CONFIG
// string: numbers where they are written, never a crash.
#include <cstdint>

#include "app/programs/brands/fanuc.h"
#include "tests/fuzz/program_checks.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  // A zero separates two files of one program.
  const auto zero = std::min(bytes.find('\0'), bytes.size());
  CheckReading(plumbline::programs::FanucTp(),
               {{"a.ls", bytes.substr(0, zero)},
                {"b.va", "[*SYSTEM*]$" + bytes.substr(std::min(zero + 1, bytes.size()))}});
  return 0;
}
