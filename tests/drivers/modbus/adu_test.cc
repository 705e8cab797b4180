#include "drivers/modbus/adu.h"

#include <array>
#include <catch2/catch.hpp>
#include <cstdint>
#include <vector>

#include "tests/drivers/modbus/rtu_frame.h"

namespace plumbline::adu_test {

using namespace plumbline::modbus;

namespace {

using State = TcpFrame::State;

const Bytes kRead = {3, 0, 2, 0, 2};
const Bytes kReadReply = {3, 4, 0, 2, 0, 3};

}  // namespace

TEST_CASE("TCP frames: state for each kind of stream", "[modbus][adu]") {
  struct Case {
    const char* what;
    Bytes stream;
    State state;
  };
  const Case cases[] = {
      {"nothing", {}, State::kIncomplete},
      {"one byte", {0}, State::kIncomplete},
      {"header only", {0, 1, 0, 0, 0, 6, 1}, State::kIncomplete},
      {"a byte missing", {0, 1, 0, 0, 0, 6, 1, 3, 0, 0, 0}, State::kIncomplete},
      {"whole", {0, 1, 0, 0, 0, 6, 1, 3, 0, 0, 0, 1}, State::kComplete},
      {"shortest", {0, 1, 0, 0, 0, 2, 1, 3}, State::kComplete},
      {"protocol id 1", {0, 1, 0, 1}, State::kBroken},
      {"protocol id 0x100", {0, 1, 1, 0, 0, 6, 1, 3, 0, 0, 0, 1}, State::kBroken},
      {"length 0", {0, 1, 0, 0, 0, 0}, State::kBroken},
      {"length 1", {0, 1, 0, 0, 0, 1, 1}, State::kBroken},
      {"length 255", {0, 1, 0, 0, 0, 255}, State::kBroken},
      {"length 65535", {0, 1, 0, 0, 0xFF, 0xFF}, State::kBroken},
      {"length 254, waiting", {0, 1, 0, 0, 0, 254}, State::kIncomplete},
      {"text", {'G', 'E', 'T', ' ', '/'}, State::kBroken},
  };
  for (const Case& c : cases) {
    INFO(c.what);
    CHECK(ParseTcpFrame(c.stream).state == c.state);
  }
}

TEST_CASE("TCP frames: several in a row, the last one partial", "[modbus][adu]") {
  const Bytes stream = {1, 2, 0, 0, 0, 6, 9, 3, 0, 0, 0, 1, 3, 4, 0, 0, 0, 2, 1, 0x55, 5, 6};
  const TcpFrame first = ParseTcpFrame(stream);
  CHECK(first.transaction == 0x0102);
  CHECK(first.unit == 9);
  CHECK(Bytes(first.pdu.begin(), first.pdu.end()) == Bytes{3, 0, 0, 0, 1});
  const auto rest = std::span(stream).subspan(first.size);
  const TcpFrame second = ParseTcpFrame(rest);
  CHECK(second.transaction == 0x0304);
  CHECK(Bytes(second.pdu.begin(), second.pdu.end()) == Bytes{0x55});
  CHECK(ParseTcpFrame(rest.subspan(second.size)).state == State::kIncomplete);
}

TEST_CASE("TCP frames: a written header parses to the same values", "[modbus][adu]") {
  for (const std::size_t size : {std::size_t{1}, std::size_t{5}, kMaxPduBytes}) {
    Bytes frame(kMbapBytes + size, 3);
    WriteMbap(std::span<std::uint8_t, kMbapBytes>(frame.data(), kMbapBytes), 0xABCD, 17, size);
    const TcpFrame read = ParseTcpFrame(frame);
    CHECK(read.state == State::kComplete);
    CHECK(read.transaction == 0xABCD);
    CHECK(read.unit == 17);
    CHECK(read.pdu.size() == size);
  }
}

TEST_CASE("RTU: checksum and silence as specified", "[modbus][adu]") {
  const Bytes check = {'1', '2', '3', '4', '5', '6', '7', '8', '9'};
  CHECK(Crc16(check) == 0x4B37);  // published check value of CRC-16/MODBUS
  CHECK(Rtu(2, {7}) == Bytes{2, 7, 0x41, 0x12});
  CHECK(RtuSilence_s(9600) == Approx(0.00401).epsilon(0.01));
  CHECK(RtuSilence_s(19200) == Approx(0.0020).epsilon(0.01));
  CHECK(RtuSilence_s(115200) == 0.00175);
}

TEST_CASE("RTU: requests that a slave with address 5 extracts from the line", "[modbus][adu]") {
  Bytes broken = Rtu(5, kRead);
  broken.back() ^= 1;
  // The data of another slave's reply contains a complete request to us, with a valid checksum.
  const Bytes bait = Rtu(9, Bytes{3, 8} + Rtu(5, kRead));
  struct Case {
    const char* what;
    Bytes line;
    int requests;
    bool newest;
    bool rest;
  };
  const Case cases[] = {
      {"own request", Rtu(5, kRead), 1, true, false},
      {"own write", Rtu(5, {16, 0, 1, 0, 1, 2, 3, 4}), 1, true, false},
      {"own FC23", Rtu(5, {23, 0, 1, 0, 1, 0, 1, 0, 1, 2, 3, 4}), 1, true, false},
      {"own identification", Rtu(5, {43, 14, 1, 0}), 1, true, false},
      {"unknown function, cut by silence", Rtu(5, {0x55, 1, 2, 3, 4}), 1, true, false},
      {"wrong length, cut by silence", Rtu(5, {3, 0, 2, 0, 2, 0, 0}), 1, true, false},
      {"broadcast", Rtu(0, {6, 0, 1, 0, 1}), 1, true, false},
      {"another's request", Rtu(9, kRead), 0, false, false},
      {"another's request and reply", Rtu(9, kRead) + Rtu(9, kReadReply), 0, false, false},
      {"another's exception", Rtu(9, {0x83, 2}), 0, false, false},
      {"another's reply, then ours", Rtu(9, kReadReply) + Rtu(5, kRead), 1, true, false},
      {"ours, then another's", Rtu(5, kRead) + Rtu(9, kRead), 1, false, false},
      {"request sent twice", Rtu(5, kRead) + Rtu(5, kRead), 2, true, false},
      {"a reply that carries a request", bait, 0, false, false},
      {"wrong check sum", broken, 0, false, true},
      {"noise before a request", Bytes{0xFF, 0x00} + Rtu(5, kRead), 0, false, true},
      {"half a request", {5, 3, 0, 2}, 0, false, true},
      {"too long for any frame", Bytes(2000, 5), 0, false, true},
  };
  for (const Case& c : cases) {
    INFO(c.what);
    RtuReceiver receiver(5);
    receiver.Push(c.line);
    int requests = 0;
    bool newest = false;
    while (const auto frame = receiver.Next()) {
      ++requests;
      newest = frame->newest;
    }
    CHECK(requests == c.requests);
    CHECK(newest == c.newest);
    CHECK(receiver.pending() == c.rest);
    receiver.Clear();
    receiver.Push(Rtu(5, kRead));
    CHECK(receiver.Next().has_value());
  }
}

TEST_CASE("RTU: a request in pieces", "[modbus][adu]") {
  modbus::RtuReceiver receiver(5);
  const Bytes frame = Rtu(5, kRead);
  for (std::size_t i = 0; i < frame.size(); ++i) {
    CHECK_FALSE(receiver.Next().has_value());
    receiver.Push({frame.data() + i, 1});
  }
  const auto request = receiver.Next();
  REQUIRE(request.has_value());
  CHECK(Bytes(request->pdu.begin(), request->pdu.end()) == kRead);
  CHECK_FALSE(receiver.pending());
}

}  // namespace plumbline::adu_test
