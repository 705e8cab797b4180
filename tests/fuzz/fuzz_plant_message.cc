// Fuzzer: messages that reach the collector. The first line is the type, or a topic if it has a
// slash. What is accepted is a row of COPY's binary format with the table's number of columns.
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

/// Number of fields, if the lengths before them add up to the whole.
int FieldsOf(std::string_view row) {
  int fields = 0;
  while (!row.empty()) {
    Require(row.size() >= 4);
    std::uint32_t length = 0;
    for (const char c : row.substr(0, 4)) length = length << 8 | static_cast<unsigned char>(c);
    row.remove_prefix(4);
    constexpr std::uint32_t kNull = 0xFFFFFFFF;
    if (length != kNull) {
      Require(row.size() >= length);
      row.remove_prefix(length);
    }
    ++fields;
  }
  return fields;
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
  constexpr int kOfKey = 4;
  Require(FieldsOf(message->row.bytes()) == message->row.fields());
  Require(message->row.fields() + kOfKey == std::ranges::count(statement, ',') + 1);
  return 0;
}
