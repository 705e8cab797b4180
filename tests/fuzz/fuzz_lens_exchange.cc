// Fuzzer: lens files of other programs. Whatever is read is finite and has a positive size, and
// survives being written and read again.
#include <cmath>
#include <cstdlib>
#include <string_view>

#include "app/vision/lens_files/lens_files.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace plumbline;  // NOLINT(google-build-using-namespace)
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast)
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const auto read = vision::LensFromFile(bytes);
  if (!read) {
    if (read.error().empty()) std::abort();
    return 0;
  }
  if (!(read->lens.fx > 0) || !(read->lens.fy > 0) || read->size.width < 1) std::abort();
  vision::LensEntry entry;
  static_cast<lens::KnownLens&>(entry) = *read;
  for (const char* name : {"a.xml", "a.yaml", "a.dat"}) {
    const auto written = vision::LensFileOf(entry, name);
    if (!written) std::abort();
    const auto again = vision::LensFromFile(*written);
    if (!again || again->lens.fx != read->lens.fx || again->lens.k3 != read->lens.k3) std::abort();
  }
  return 0;
}
