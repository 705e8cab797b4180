// Fuzzer: messages that reach the collector. The first line is the type, or a topic if it has a
// slash. What is accepted is one line of COPY's text format with the table's number of columns.
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "app/plant/collect/message_decoder.h"

namespace {

using namespace plumbline::plant;  // NOLINT(google-build-using-namespace)

void Require(bool condition) {
  if (!condition) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto end = text.find('\n');
  if (end == std::string_view::npos) return 0;
  const std::string_view type = text.substr(0, end), payload = text.substr(end + 1);
  if (const auto topic = TopicPartsOf(type)) Require(!topic->line.empty() && !topic->node.empty());
  const auto key = KeyAtBeginningOf(payload);
  const auto message = DecodeMessage(type, payload);
  if (!message) {
    Require(!message.error().empty());
    return 0;
  }
  // The two readers of the number agree, unless the payload states it twice.
  if (key && message->key && payload.find("\"seq\"", 25) == std::string_view::npos) {
    Require(key->seq == message->key->seq || payload.find('\\') != std::string_view::npos);
  }
  if (!message->table) return 0;
  Require(message->key.has_value() && message->key->seq > 0);
  const std::string& statement = CopyStatementOf(*message->table);
  constexpr std::ptrdiff_t kOfKey = 4;
  Require(std::ranges::count(message->row, '\n') == 0);
  Require(std::ranges::count(message->row, '\t') + kOfKey == std::ranges::count(statement, ','));
  return 0;
}
