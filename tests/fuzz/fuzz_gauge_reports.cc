// Fuzzer: arbitrary HID reports from a dial gauge. The first byte of each is its length.
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <string>

#include "drivers/gauge/gauge_codec.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  namespace gauge = plumbline::gauge;
  gauge::KeyReports keys;
  gauge::LineReceiver typed_lines, sent_lines;
  std::span<const std::uint8_t> rest(data, size);
  while (!rest.empty()) {
    const std::size_t length = std::min<std::size_t>(rest[0] % 66, rest.size() - 1);
    const auto report = rest.subspan(1, length);
    rest = rest.subspan(1 + length);
    std::string typed, sent;
    keys.Push(report, typed);
    gauge::AppendReportText(report, sent);
    if (typed.size() > 6 || sent.size() > report.size() + 1) std::abort();
    for (const char c : typed + sent) {
      if (c == '\0') std::abort();
    }
    for (const char c : typed) {
      if (const auto line = typed_lines.Push(c)) gauge::FindGaugeFormat("plain")->parse(*line);
    }
    for (const char c : sent) {
      if (const auto line = sent_lines.Push(c)) gauge::FindGaugeFormat("mitutoyo")->parse(*line);
    }
  }
  return 0;
}
