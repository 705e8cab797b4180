// Fuzzer: arbitrary bytes from a dial gauge.
#include <cmath>
#include <cstdint>
#include <cstdlib>

#include "drivers/gauge/gauge_codec.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using plumbline::gauge::GaugeLine;
  plumbline::gauge::LineReceiver receiver;
  for (std::size_t i = 0; i < size; ++i) {
    const auto line = receiver.Push(static_cast<char>(data[i]));
    if (!line) continue;
    if (line->empty() || line->size() > plumbline::gauge::kMaxLineBytes + 1) std::abort();
    for (const auto& format : plumbline::gauge::GaugeFormats()) {
      const GaugeLine found = format.parse(*line);
      if (!std::isfinite(found.value) || std::abs(found.value) >= 1e10) std::abort();
      if ((found.kind == GaugeLine::Kind::kFault) == found.fault.empty()) std::abort();
    }
  }
  return 0;
}
