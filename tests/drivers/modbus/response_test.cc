#include <catch2/catch.hpp>
#include <string>

#include "drivers/modbus/adu.h"
#include "tests/drivers/modbus/rtu_frame.h"

namespace plumbline::response_test {

using namespace plumbline::modbus;

namespace {

using State = ResponseCheck::State;
using Check = ResponseCheck (*)(std::span<const std::uint8_t>, std::span<const std::uint8_t>);

struct Case {
  const char* what;
  Bytes request;
  Bytes response;
  State state;
  const char* mismatch = "";
};

void ExpectEach(const std::vector<Case>& cases, Check check) {
  for (const Case& c : cases) {
    INFO(c.what);
    const ResponseCheck found = check(c.request, c.response);
    CHECK(found.state == c.state);
    CHECK(std::string(found.what) == c.mismatch);
    if (found.state == State::kMismatch) continue;
    // Every shorter part may still become the response, and no byte after it is asked for.
    for (std::size_t size = 0; size < c.response.size(); ++size) {
      const ResponseCheck part = check(c.request, std::span(c.response).first(size));
      CHECK(part.state == State::kIncomplete);
      CHECK(part.size > size);
      CHECK(part.size <= c.response.size());
    }
  }
}

Bytes With(Bytes bytes, std::size_t at, int value) {
  bytes[at] = static_cast<std::uint8_t>(value);
  return bytes;
}

/// Two holding registers from 0x0102 of unit 5.
const Bytes kRead = {0x12, 0x34, 0, 0, 0, 6, 5, 3, 1, 2, 0, 2};
const Bytes kReadAnswer = {0x12, 0x34, 0, 0, 0, 7, 5, 3, 4, 0, 9, 0, 8};
const Bytes kCoils = {0x12, 0x34, 0, 0, 0, 6, 5, 1, 0, 0, 0, 9};
const Bytes kCoilsAnswer = {0x12, 0x34, 0, 0, 0, 5, 5, 1, 2, 0xFF, 1};
const Bytes kWriteOne = {0x12, 0x34, 0, 0, 0, 6, 5, 6, 1, 2, 3, 4};
const Bytes kWrite = {0x12, 0x34, 0, 0, 0, 9, 5, 16, 1, 2, 0, 1, 2, 7, 7};
const Bytes kWriteAnswer = {0x12, 0x34, 0, 0, 0, 6, 5, 16, 1, 2, 0, 1};
const Bytes kException = {0x12, 0x34, 0, 0, 0, 3, 5, 0x83, 2};

}  // namespace

TEST_CASE("a TCP response is compared with its request in every element", "[modbus][response]") {
  const State wrong = State::kMismatch;
  const Case cases[] = {
      {"answer", kRead, kReadAnswer, State::kAnswer},
      {"nine coils in two bytes", kCoils, kCoilsAnswer, State::kAnswer},
      {"echo of a write", kWriteOne, kWriteOne, State::kAnswer},
      {"address and count of a long write", kWrite, kWriteAnswer, State::kAnswer},
      {"exception", kRead, kException, State::kException},
      {"nothing yet", kRead, {}, State::kIncomplete},
      {"transaction", kRead, With(kReadAnswer, 1, 0x33), wrong, "transaction id"},
      {"transaction 0", kRead, With(With(kReadAnswer, 0, 0), 1, 0), wrong, "transaction id"},
      {"protocol", kRead, With(kReadAnswer, 3, 1), wrong, "protocol id"},
      {"header too short", kRead, With(kReadAnswer, 5, 6), wrong, "length in the header"},
      {"header too long", kRead, With(kReadAnswer, 5, 9), wrong, "length in the header"},
      {"unit", kRead, With(kReadAnswer, 6, 6), wrong, "unit id"},
      {"unit 0", kRead, With(kReadAnswer, 6, 0), wrong, "unit id"},
      {"function", kRead, With(kReadAnswer, 7, 4), wrong, "function code"},
      {"exception of another function", kRead, With(kException, 7, 0x84), wrong, "function code"},
      {"exception of no meaning", kRead, With(kException, 8, 77), wrong,
       "undefined exception code"},
      {"byte count", kRead, With(kReadAnswer, 8, 2), wrong, "byte count"},
      {"a byte more", kRead, kReadAnswer + Bytes{0}, wrong, "number of bytes"},
      {"written address", kWriteOne, With(kWriteOne, 9, 3), wrong, "written address"},
      {"written value", kWriteOne, With(kWriteOne, 11, 5), wrong, "written value or count"},
      {"written count", kWrite, With(kWriteAnswer, 11, 2), wrong, "written value or count"},
      {"the answer to a write", kRead, kWriteAnswer, wrong, "function code"},
      {"an unknown request", With(kRead, 7, 43), kReadAnswer, wrong,
       "a request without a known answer"},
  };
  ExpectEach({std::begin(cases), std::end(cases)}, CheckTcpResponse);
}

TEST_CASE("an RTU response is compared with its request in every element", "[modbus][response]") {
  const State wrong = State::kMismatch;
  const Bytes read = Rtu(5, {3, 1, 2, 0, 2});
  const Bytes answer = Rtu(5, {3, 4, 0, 9, 0, 8});
  const Bytes write = Rtu(5, {6, 1, 2, 3, 4});
  const Bytes exception = Rtu(5, {0x83, 6});
  const Case cases[] = {
      {"answer", read, answer, State::kAnswer},
      {"echo of a write", write, write, State::kAnswer},
      {"exception", read, exception, State::kException},
      {"unit", read, Rtu(6, {3, 4, 0, 9, 0, 8}), wrong, "unit id"},
      {"unit 0", read, Rtu(0, {3, 4, 0, 9, 0, 8}), wrong, "unit id"},
      {"function", read, Rtu(5, {4, 4, 0, 9, 0, 8}), wrong, "function code"},
      {"byte count", read, Rtu(5, {3, 2, 0, 9}), wrong, "byte count"},
      {"checksum", read, With(answer, 4, 8), wrong, "checksum"},
      {"checksum of an exception", read, With(exception, 2, 4), wrong, "checksum"},
      {"a byte more", read, answer + Bytes{0}, wrong, "number of bytes"},
      {"echo of the request", read, read, wrong, "byte count"},
      {"written value", write, Rtu(5, {6, 1, 2, 3, 5}), wrong, "written value or count"},
  };
  ExpectEach({std::begin(cases), std::end(cases)}, CheckRtuResponse);
  CHECK(CheckRtuResponse(read, answer).data == 3);
}

TEST_CASE("a mismatch has the value found and the one expected", "[modbus][response]") {
  const ResponseCheck check = CheckTcpResponse(kRead, With(kReadAnswer, 6, 6));
  CHECK(check.found == 6);
  CHECK(check.expected == 5);
}

}  // namespace plumbline::response_test
