// Fuzzer: arbitrary bytes as a table of poses: numbers where they are written, or a refusal with a
// remedy, never a crash.
#include <cstdint>

#include "app/programs/brands/pose_table.h"
#include "tests/fuzz/program_checks.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  CheckReading(*plumbline::programs::PoseTables().front(), {{"a.csv", bytes}});
  return 0;
}
