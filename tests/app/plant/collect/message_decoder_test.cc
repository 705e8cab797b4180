#include "app/plant/collect/message_decoder.h"

#include <catch2/catch.hpp>

#include "tests/app/plant/collect/plant_messages.h"

namespace plumbline::plant::message_decoder_test {

constexpr std::int64_t kUtc_ms = 1'795'260'031'500;

std::string ErrorOf(std::string_view type, std::string_view payload) {
  const auto message = DecodeMessage(type, payload);
  return message ? "" : message.error();
}

TEST_CASE("topics of cells are recognised") {
  const auto topic = TopicPartsOf("plumblineV1/line-1/NPROBE/cell 7");
  REQUIRE(topic);
  CHECK(topic->line == "line-1");
  CHECK(topic->type == "NPROBE");
  CHECK(topic->node == "cell 7");
  for (const char* other : {"", "plumblineV1", "plumblineV1/a/NDATA", "plumblineV1/a/NDATA/",
                            "plumblineV1/a/NDATA/b/c", "plumblineV2/a/NDATA/b", "//NDATA/b"}) {
    CHECK_FALSE(TopicPartsOf(other));
  }
  CHECK_FALSE(TopicPartsOf("plumblineV1/a/NDATA/" + std::string(65, 'x')));
}

TEST_CASE("a probe as it is published becomes a row") {
  const test::PublishingCell cell;
  const Received probe = cell.Probe(4712, kUtc_ms);
  const auto key = KeyAtBeginningOf(probe.payload);
  REQUIRE(key);
  CHECK(key->stream == 0xa001);
  CHECK(key->seq == 4712);
  CHECK(key->utc_ms == kUtc_ms);
  const auto message = DecodeMessage("NPROBE", probe.payload);
  REQUIRE(message);
  CHECK(message->table == MessageTable::kProbe);
  CHECK(message->row.fields() == 19);
  CHECK(message->probe->size_mm == 0.1);
  CHECK(message->model == 3);
}

TEST_CASE("states, births and deaths are understood") {
  const test::PublishingCell cell;
  const Received sent = cell.State(1, kUtc_ms);
  const auto state = DecodeMessage("NDATA", sent.payload);
  REQUIRE(state);
  CHECK_FALSE(state->table);
  CHECK(state->state->json.find("\"health\":0") != std::string::npos);
  const auto birth = DecodeMessage(
      "NBIRTH",
      R"({"timestamp":1,"bdSeq":1795260031500,"version":"0.1.0","cell":"KR 210","stream":"0000a001",)"
      R"("waiting":7,"dropped":{"states":5,"changes":1,"others":0}})");
  REQUIRE(birth);
  CHECK(birth->birth->bdSeq == kUtc_ms);
  CHECK(birth->birth->waiting == 7);
  CHECK(birth->dropped->messages == 6);
  CHECK_FALSE(birth->key);
  const auto death = DecodeMessage("NDEATH", DeathText(kUtc_ms, 1, true));
  REQUIRE(death);
  CHECK(death->death->clean_shutdown);
}

TEST_CASE("what cannot be read is refused with what is wrong") {
  const std::string head = R"({"stream":"0000a001","seq":1,"timestamp":1795260031500)";
  CHECK(ErrorOf("NPROBE", "hello") == "is not JSON");
  CHECK(ErrorOf("NPROBE", "[1]") == "is not a JSON object");
  CHECK(ErrorOf("NPROBE", R"({"stream":"xyz"})") == "stream is not eight hexadecimal digits");
  CHECK(ErrorOf("NPROBE", R"({"stream":"0000a001","seq":0})") ==
        "seq is not an integer of 1..2^53");
  CHECK(ErrorOf("NPROBE", R"({"stream":"0000a001","seq":18446744073709551615})") ==
        "seq is not an integer of 1..2^53");
  CHECK(
      ErrorOf("NPROBE", R"({"stream":"0000a001","seq":1,"timestamp":5})").starts_with("timestamp"));
  CHECK(ErrorOf("NPROBE", head + "}") == "journal is missing");
  CHECK(ErrorOf("NALARM", head + R"(,"word":"alarms","bit":"2","meaning":"x"})") ==
        "bit has a value of another kind or size");
  CHECK(ErrorOf("NALARM", head + R"(,"word":"alarms","bit":2,"meaning":"x","event":"maybe"})") ==
        "event is neither begin nor end");
  CHECK(
      ErrorOf("NOTHER", head + "}").starts_with("is of a type that this collector does not know"));
  CHECK(ErrorOf("NPROBE", std::string(1'000'000, ' ')) ==
        "has 1000000 bytes, at most 65536 are read");
  // A number that no column holds.
  CHECK(ErrorOf("NMODEL", head + R"(,"model":99999999999})") == "model is out of range");
}

}  // namespace plumbline::plant::message_decoder_test
