#include "drivers/zoom/visca_codec.h"

#include <catch2/catch.hpp>
#include <random>
#include <vector>

namespace plumbline::visca_codec_test {

using namespace plumbline::visca;

namespace {

using Bytes = std::vector<std::uint8_t>;
using Kind = Reply::Kind;

Bytes BytesOf(const Request& request) {
  return {request.span().begin(), request.span().end()};
}

/// All packets of a stream.
std::vector<Reply> Received(const Bytes& stream) {
  Receiver receiver;
  std::vector<Reply> replies;
  for (const std::uint8_t byte : stream) {
    if (const auto reply = receiver.Push(byte)) replies.push_back(*reply);
  }
  return replies;
}

}  // namespace

TEST_CASE("requests, byte by byte") {
  CHECK(BytesOf(AddressSet()) == Bytes{0x88, 0x30, 0x01, 0xFF});
  CHECK(BytesOf(ZoomPosition(1)) == Bytes{0x81, 0x09, 0x04, 0x47, 0xFF});
  CHECK(BytesOf(FocusPosition(7)) == Bytes{0x87, 0x09, 0x04, 0x48, 0xFF});
  CHECK(BytesOf(LensBlock(2)) == Bytes{0x82, 0x09, 0x7E, 0x7E, 0x00, 0xFF});
}

TEST_CASE("each kind of packet, and malformed ones") {
  struct Case {
    Bytes packet;
    Kind kind;
    int address, error;
  };
  const Case cases[] = {
      {{0x88, 0x30, 0x02, 0xFF}, Kind::kAddressed, 1, 0},
      {{0x88, 0x30, 0x08, 0xFF}, Kind::kAddressed, 7, 0},
      {{0x88, 0x30, 0x01, 0xFF}, Kind::kMalformed, 0, 0},  // our own, echoed by a loopback
      {{0x88, 0x30, 0x09, 0xFF}, Kind::kMalformed, 0, 0},
      {{0x88, 0x01, 0x00, 0x01, 0xFF}, Kind::kCleared, 0, 0},
      {{0x88, 0x01, 0x00, 0xFF}, Kind::kMalformed, 0, 0},
      {{0x90, 0x38, 0xFF}, Kind::kNetworkChange, 1, 0},
      {{0xF0, 0x38, 0xFF}, Kind::kNetworkChange, 7, 0},
      {{0x90, 0x41, 0xFF}, Kind::kAck, 1, 0},
      {{0x90, 0x51, 0xFF}, Kind::kDone, 1, 0},
      {{0x90, 0x50, 0x00, 0x01, 0x02, 0x03, 0xFF}, Kind::kAnswer, 1, 0},
      {{0xA0, 0x60, 0x02, 0xFF}, Kind::kError, 2, 2},
      {{0xA0, 0x61, 0x41, 0xFF}, Kind::kError, 2, 0x41},
      {{0x90, 0x60, 0xFF}, Kind::kMalformed, 1, 0},
      {{0x90, 0x60, 0x02, 0x02, 0xFF}, Kind::kMalformed, 1, 0},
      {{0x81, 0x09, 0x04, 0x47, 0xFF}, Kind::kMalformed, 0, 0},  // sent by a controller
      {{0x91, 0x41, 0xFF}, Kind::kMalformed, 0, 0},
      {{0x80, 0x41, 0xFF}, Kind::kMalformed, 0, 0},
      {{0x90, 0xFF}, Kind::kMalformed, 0, 0},
      {{0xFF}, Kind::kMalformed, 0, 0},
  };
  for (const Case& c : cases) {
    CAPTURE(c.packet);
    const std::vector<Reply> replies = Received(c.packet);
    REQUIRE(replies.size() == 1);
    CHECK(replies[0].kind == c.kind);
    CHECK(replies[0].address == c.address);
    CHECK(replies[0].error == c.error);
  }
}

TEST_CASE("positions: nibbles only, of the right length") {
  const auto position = [](const Bytes& bytes) { return PositionFrom(ReplyFromPacket(bytes)); };
  CHECK(position({0x90, 0x50, 0x04, 0x00, 0x00, 0x00, 0xFF}) == 0x4000);
  CHECK(position({0x90, 0x50, 0x0F, 0x0F, 0x0F, 0x0F, 0xFF}) == 0xFFFF);
  CHECK_FALSE(position({0x90, 0x50, 0x04, 0x10, 0x00, 0x00, 0xFF}));
  CHECK_FALSE(position({0x90, 0x50, 0x04, 0x00, 0x00, 0xFF}));
  CHECK_FALSE(position({0x90, 0x60, 0x02, 0xFF}));
}

TEST_CASE("lens block: zoom, focus, digital zoom, motion") {
  const Bytes good = {0x90, 0x50, 0x02, 0x08, 0x06, 0x00, 0x00, 0x00,
                      0x01, 0x0A, 0x0B, 0x0C, 0x00, 0x00, 0x00, 0xFF};
  const auto read = [&good](std::size_t at, std::uint8_t value, lens::ZoomReading& reading) {
    Bytes block = good;
    block[at] = value;
    return LensBlockFrom(ReplyFromPacket(block), reading);
  };
  lens::ZoomReading reading;
  REQUIRE(read(0, 0x90, reading));
  CHECK(reading.zoom_counts == 0x2860);
  CHECK(reading.focus_counts == 0x1ABC);
  CHECK(reading.digital_zoom == false);
  CHECK(reading.motion == lens::LensMotion::kSettled);
  REQUIRE(read(13, 0x02, reading));
  CHECK(reading.digital_zoom == true);
  REQUIRE(read(13, 0x0D, reading));
  CHECK(reading.digital_zoom == false);
  REQUIRE(read(14, 0x01, reading));
  CHECK(reading.motion == lens::LensMotion::kMoving);
  REQUIRE(read(14, 0x02, reading));  // the focus moves
  CHECK(reading.motion == lens::LensMotion::kSettled);

  lens::ZoomReading untouched;
  untouched.zoom_counts = 7;
  CHECK_FALSE(read(2, 0x12, untouched));
  CHECK_FALSE(read(11, 0x80, untouched));
  CHECK_FALSE(read(1, 0x60, untouched));
  CHECK(untouched.zoom_counts == 7);
  CHECK_FALSE(untouched.focus_counts);
}

TEST_CASE("an overlong packet is discarded up to its FF; the next one is decoded") {
  Bytes stream(1000, 0x90);
  stream.push_back(0xFF);
  stream.insert(stream.end(), {0x90, 0x41, 0xFF});
  const std::vector<Reply> replies = Received(stream);
  REQUIRE(replies.size() == 2);
  CHECK(replies[0].kind == Kind::kMalformed);
  CHECK(replies[1].kind == Kind::kAck);

  for (std::size_t size : {14U, 15U, 16U, 17U}) {  // before the FF
    Bytes packet(size, 0x00);
    packet[0] = 0x90;
    packet[1] = 0x50;
    packet.push_back(0xFF);
    CAPTURE(size);
    CHECK(Received(packet)[0].kind == (size <= 15 ? Kind::kAnswer : Kind::kMalformed));
  }
}

TEST_CASE("any bytes: packets stay within the maximum size and values within their range") {
  std::mt19937 random(7);
  const std::uint8_t favourites[] = {0x90, 0x50, 0xFF, 0x00, 0x0F, 0x60, 0x41, 0x88, 0x30, 0x02};
  for (int run = 0; run < 2000; ++run) {
    Bytes stream(1 + random() % 60);
    for (std::uint8_t& byte : stream) {
      byte = random() % 2 == 0 ? favourites[random() % 10] : static_cast<std::uint8_t>(random());
    }
    for (const Reply& reply : Received(stream)) {
      REQUIRE(reply.size <= kMaxPacketBytes);
      REQUIRE(reply.address >= 0);
      REQUIRE(reply.address <= kMaxCameras);
      const auto counts = PositionFrom(reply);
      REQUIRE((!counts || (*counts >= 0 && *counts <= 0xFFFF)));
    }
  }
}

TEST_CASE("datagrams, byte by byte") {
  const auto bytes = [](const Datagram& datagram) {
    return Bytes(datagram.span().begin(), datagram.span().end());
  };
  CHECK(bytes(InquiryDatagram(ZoomPosition(1), 0x01020304)) ==
        Bytes{0x01, 0x10, 0, 5, 1, 2, 3, 4, 0x81, 0x09, 0x04, 0x47, 0xFF});
  CHECK(bytes(InquiryDatagram(LensBlock(1), 0xFFFFFFFF)) ==
        Bytes{0x01, 0x10, 0, 6, 0xFF, 0xFF, 0xFF, 0xFF, 0x81, 0x09, 0x7E, 0x7E, 0x00, 0xFF});
  CHECK(bytes(SequenceReset()) == Bytes{0x02, 0x00, 0, 1, 0, 0, 0, 0, 0x01});
}

TEST_CASE("each kind of datagram, and malformed ones") {
  using DatagramKind = DatagramReply::Kind;
  struct Case {
    Bytes datagram;
    DatagramKind kind;
    std::uint32_t sequence;
  };
  const Case cases[] = {
      {{1, 0x11, 0, 3, 0, 0, 1, 2, 0x90, 0x41, 0xFF}, DatagramKind::kReply, 258},
      {{1, 0x11, 0, 4, 0xFF, 0xFF, 0xFF, 0xFF, 0x90, 0x60, 0x02, 0xFF},
       DatagramKind::kReply,
       0xFFFFFFFF},
      {{2, 1, 0, 1, 0, 0, 0, 0, 1}, DatagramKind::kSequenceReset, 0},
      {{2, 1, 0, 2, 0, 0, 0, 9, 0x0F, 1}, DatagramKind::kUnexpectedSequence, 9},
      {{2, 0, 0, 2, 0, 0, 0, 9, 0x0F, 1}, DatagramKind::kUnexpectedSequence, 9},
      {{2, 1, 0, 2, 0, 0, 0, 9, 0x0F, 2}, DatagramKind::kMalformed, 9},  // of the message
      {{0x90, 0x41, 0xFF}, DatagramKind::kWithoutHeader, 0},
      {{0x90, 0x50, 1, 2, 3, 4, 0xFF}, DatagramKind::kWithoutHeader, 0},
      {{1, 0x11, 0, 4, 0, 0, 0, 2, 0x90, 0x41, 0xFF}, DatagramKind::kMalformed, 2},  // length
      {{1, 0x10, 0, 3, 0, 0, 0, 2, 0x90, 0x41, 0xFF}, DatagramKind::kMalformed, 2},  // an inquiry
      {{1, 0x11, 0, 6, 0, 0, 0, 2, 0x90, 0x41, 0xFF, 0x90, 0x51, 0xFF},              // two packets
       DatagramKind::kMalformed,
       2},
      {{1, 0x11, 0, 3, 0, 0, 0, 2, 0x81, 0x41, 0xFF}, DatagramKind::kMalformed, 2},
      {{1, 0x11, 0, 0, 0, 0, 0, 2}, DatagramKind::kMalformed, 0},
      {{}, DatagramKind::kMalformed, 0},
  };
  for (const Case& c : cases) {
    CAPTURE(c.datagram);
    const DatagramReply found = ReplyFromDatagram(c.datagram);
    CHECK(found.kind == c.kind);
    CHECK(found.sequence == c.sequence);
    CHECK((found.reply.kind == Kind::kMalformed) == (c.kind != DatagramKind::kReply));
  }
}

}  // namespace plumbline::visca_codec_test
