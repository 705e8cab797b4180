// Fuzzer: what reaches the Sparkplug bridge from its brokers: a cell's messages, a host's commands
// and its state. The first byte selects the reader; accepted messages are applied and published.
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "app/plant/sparkplug/kept_points.h"
#include "app/plant/sparkplug/payload.h"

namespace {

using namespace plumbline::plant;  // NOLINT(google-build-using-namespace)

void Require(bool condition) {
  if (!condition) std::abort();
}

/// Messages one after another, separated by line breaks, to one cell.
void ApplyLines(std::uint8_t first, std::string_view text) {
  MetricStore store;
  for (int topic = first % std::size(kCellTopics); !text.empty();
       topic = static_cast<int>((topic + 1) % std::size(kCellTopics))) {
    const auto end = text.find('\n');
    const auto message = CellMessageFromText(static_cast<CellTopic>(topic), text.substr(0, end));
    text = end == std::string_view::npos ? "" : text.substr(end + 1);
    if (!message) {
      Require(!message.error().empty());
      continue;
    }
    store.Apply(*message);
    Require(store.size() <= MetricStore::kMaxMetrics);
    Require(!CommandFromPayload(NodeBirth(store, 1, 0, 1)).value().rebirth);
    Require(CommandFromPayload(NodeData(store, 1, 1)).ok() && !store.has_changes());
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view text(reinterpret_cast<const char*>(data) + 1, size - 1);
  switch (*data) {
    case 'C':
      if (const auto command = CommandFromPayload(text)) Require(command->ignored.size() <= 8);
      break;
    case 'V':
      if (const auto points = KeptPointsFromText(text))
        Require(KeptPointsFromText(TextOfKeptPoints(*points)).ok());
      break;
    case 'H':
      static_cast<void>(HostStateFromText(text));
      break;
    case 'T':
      static_cast<void>(CellAddressFromTopic(text));
      break;
    default:
      ApplyLines(*data, text);
  }
  return 0;
}
