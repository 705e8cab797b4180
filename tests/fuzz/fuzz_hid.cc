// Fuzzer: any profile accepted by the reader decodes any report, so reader and codec agree on what
// a valid profile is. The input up to a zero byte is the profile, the rest are reports.
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "app/base/config/zoom_profile_reader.h"

namespace {

using namespace plumbline;  // NOLINT(google-build-using-namespace)

constexpr std::string_view kProfile = R"(schema = 1
name = "fuzz"
source = "none"
vendor_id = 1
product_id = 2
[[exchange]]
answer_id = 0x13
answer_bytes = 10
count_at = 1
count = 2
[[exchange.field]]
value = "zoom_counts"
at = 2
bytes = 4
byte_order = "little"
signed = true
[[exchange.field]]
value = "focus_counts"
at = 6
bytes = 2
byte_order = "big"
signed = true
[[exchange.field]]
value = "moving"
at = 9
bytes = 1
mask = 2
)";

void Decode(const zoom::HidProfile& profile, const std::uint8_t* data, std::size_t size) {
  if (FaultOf(profile)) std::abort();  // the reader accepted what the codec rejects
  while (size > 0) {
    const std::size_t length = std::min<std::size_t>(data[0], size - 1);
    for (const zoom::HidExchange& exchange : profile.exchanges) {
      lens::ZoomReading reading;
      const zoom::HidAnswer answer = zoom::ReadingFromReport(exchange, {data + 1, length}, reading);
      const bool told = reading.zoom_counts || reading.focus_counts || reading.digital_zoom ||
                        reading.moved || reading.motion != lens::LensMotion::kUnknown;
      if (told && answer != zoom::HidAnswer::kRead) std::abort();
    }
    data += 1 + length;
    size -= 1 + length;
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  config::FaultList faults;
  static const auto fixed = config::HidProfileFromText(kProfile, "fixed", faults);
  if (!fixed) std::abort();
  Decode(*fixed, data, size);
  const std::uint8_t* end = std::find(data, data + size, std::uint8_t{0});
  const auto length = static_cast<std::size_t>(end - data);
  const std::string_view text(reinterpret_cast<const char*>(data), length);
  if (const auto profile = config::HidProfileFromText(text, "fuzz", faults)) {
    if (length < size) Decode(*profile, end + 1, size - length - 1);
  }
  return 0;
}
