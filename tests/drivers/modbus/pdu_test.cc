#include "drivers/modbus/pdu.h"

#include <array>
#include <catch2/catch.hpp>
#include <cstdint>
#include <string>
#include <vector>

#include "tests/drivers/modbus/test_image.h"

namespace plumbline::pdu_test {

using namespace plumbline::modbus;

namespace {

using Bytes = std::vector<std::uint8_t>;

struct Exchange {
  RegisterImage image = TestImage();
  CommandArea commands = TestCommands();
  DeviceIdentification identification = TestIdentification();
  PduReply last;

  Bytes Handle(const Bytes& request) {
    std::array<std::uint8_t, kMaxPduBytes> response;
    last = HandlePdu(request, image, commands, identification, response);
    return {response.begin(), response.begin() + static_cast<std::ptrdiff_t>(last.size)};
  }
};

Bytes Join(Bytes head, std::size_t count, std::uint8_t fill) {
  head.insert(head.end(), count, fill);
  return head;
}

}  // namespace

TEST_CASE("PDU: response of each function", "[modbus][pdu]") {
  struct Case {
    const char* what;
    Bytes request, answer;
  };
  const Case cases[] = {
      {"FC03", {3, 0, 2, 0, 2}, {3, 4, 0, 2, 0, 3}},
      {"FC04 reads the same image", {4, 0, 2, 0, 2}, {4, 4, 0, 2, 0, 3}},
      {"FC03 over two ranges that touch", {3, 0, 199, 0, 2}, {3, 4, 0, 199, 0, 200}},
      {"FC03 at the very end", {3, 0, 239, 0, 1}, {3, 2, 0, 239}},
      {"FC03 of the command area", {3, 0x03, 0xE8, 0, 1}, {3, 2, 0, 0}},
      {"FC01", {1, 0, 0, 0, 10}, {1, 2, 0x49, 0x02}},
      {"FC02 from an odd place", {2, 0, 3, 0, 4}, {2, 1, 0x09}},
      {"FC01 of the coils", {1, 0, 20, 0, 8}, {1, 1, 0}},
      {"FC05 on", {5, 0, 20, 0xFF, 0}, {5, 0, 20, 0xFF, 0}},
      {"FC05 off", {5, 0, 20, 0, 0}, {5, 0, 20, 0, 0}},
      {"FC06", {6, 0x03, 0xE8, 0x12, 0x34}, {6, 0x03, 0xE8, 0x12, 0x34}},
      {"FC15", {15, 0, 20, 0, 8, 1, 0xA5}, {15, 0, 20, 0, 8}},
      {"FC16", {16, 0x03, 0xE8, 0, 2, 4, 1, 2, 3, 4}, {16, 0x03, 0xE8, 0, 2}},
      {"FC22", {22, 0x03, 0xE8, 0, 0xF2, 0, 0x25}, {22, 0x03, 0xE8, 0, 0xF2, 0, 0x25}},
      {"FC23", {23, 0, 2, 0, 1, 0x03, 0xE8, 0, 1, 2, 9, 9}, {23, 2, 0, 2}},
      {"FC23 reads what it wrote",
       {23, 0x03, 0xE8, 0, 1, 0x03, 0xE8, 0, 1, 2, 9, 8},
       {23, 2, 9, 8}},
      {"an empty PDU", {}, {}},
  };
  for (const Case& c : cases) {
    Exchange exchange;
    INFO(c.what);
    CHECK(exchange.Handle(c.request) == c.answer);
  }
}

TEST_CASE("PDU: every fault returns its exception and changes nothing", "[modbus][pdu]") {
  struct Case {
    const char* what;
    Bytes request;
    int exception;
  };
  const Case cases[] = {
      {"function 0", {0}, 1},
      {"function 7", {7}, 1},
      {"function 8", {8, 0, 0, 0, 0}, 1},
      {"function 0x55", {0x55, 1, 2, 3}, 1},
      {"function 0x83", {0x83, 2}, 1},
      {"FC43 with another MEI type", {43, 13, 1, 0}, 1},
      {"FC03 into a gap", {3, 0, 18, 0, 3}, 2},
      {"FC03 in a gap", {3, 0, 50, 0, 1}, 2},
      {"FC03 out of a gap", {3, 0, 99, 0, 2}, 2},
      {"FC03 beyond the end", {3, 0, 239, 0, 2}, 2},
      {"FC03 past 65535", {3, 0xFF, 0xFF, 0, 2}, 2},
      {"FC03 past the command area", {3, 0x04, 0x0F, 0, 2}, 2},
      {"FC03 before the command area", {3, 0x03, 0xE7, 0, 2}, 2},
      {"FC01 beyond the end", {1, 0, 15, 0, 2}, 2},
      {"FC02 far away", {2, 0xFF, 0xFF, 0, 1}, 2},
      {"FC05 of an input", {5, 0, 0, 0xFF, 0}, 2},
      {"FC06 read-only", {6, 0, 2, 0, 1}, 2},
      {"FC06 in a gap", {6, 0, 50, 0, 1}, 2},
      {"FC15 past the coils", {15, 0, 21, 0, 8, 1, 0xFF}, 2},
      {"FC16 straddling the end", {16, 0x04, 0x0F, 0, 2, 4, 1, 2, 3, 4}, 2},
      {"FC16 read-only", {16, 0, 2, 0, 1, 2, 1, 2}, 2},
      {"FC22 read-only", {22, 0, 2, 0, 0, 0, 0}, 2},
      {"FC23 reading a gap", {23, 0, 50, 0, 1, 0x03, 0xE8, 0, 1, 2, 9, 9}, 2},
      {"FC23 writing read-only", {23, 0, 2, 0, 1, 0, 2, 0, 1, 2, 9, 9}, 2},
      {"FC43 of an object that is not there", {43, 14, 4, 4}, 2},
      {"FC03 of none", {3, 0, 2, 0, 0}, 3},
      {"FC03 of 126", {3, 0, 100, 0, 126}, 3},
      {"FC03 too short", {3, 0, 2, 0}, 3},
      {"FC03 with a byte too many", {3, 0, 2, 0, 1, 0}, 3},
      {"FC03 alone", {3}, 3},
      {"FC01 of none", {1, 0, 0, 0, 0}, 3},
      {"FC01 of 2001", {1, 0, 0, 0x07, 0xD1}, 3},
      {"FC01 too short", {1, 0, 0}, 3},
      {"FC05 neither on nor off", {5, 0, 20, 0, 1}, 3},
      {"FC05 too long", {5, 0, 20, 0xFF, 0, 0}, 3},
      {"FC06 too short", {6, 0x03, 0xE8, 1}, 3},
      {"FC15 of none", {15, 0, 20, 0, 0, 0}, 3},
      {"FC15 with a wrong byte count", {15, 0, 20, 0, 8, 2, 0, 0}, 3},
      {"FC15 too short", {15, 0, 20}, 3},
      {"FC15 of 1969", Join({15, 0, 20, 0x07, 0xB1, 247}, 247, 0), 3},
      {"FC16 of none", {16, 0x03, 0xE8, 0, 0, 0}, 3},
      {"FC16 with a wrong byte count", {16, 0x03, 0xE8, 0, 2, 2, 1, 2, 3, 4}, 3},
      {"FC16 with data missing", {16, 0x03, 0xE8, 0, 2, 4, 1, 2}, 3},
      {"FC16 of 124", Join({16, 0x03, 0xE8, 0, 124, 248}, 247, 0), 3},
      {"FC16 too short", {16, 0x03, 0xE8, 0}, 3},
      {"FC22 too short", {22, 0x03, 0xE8, 0, 0}, 3},
      {"FC23 of none to read", {23, 0, 2, 0, 0, 0x03, 0xE8, 0, 1, 2, 9, 9}, 3},
      {"FC23 of none to write", {23, 0, 2, 0, 1, 0x03, 0xE8, 0, 0, 0}, 3},
      {"FC23 of 122 to write", Join({23, 0, 2, 0, 1, 0x03, 0xE8, 0, 122, 244}, 243, 0), 3},
      {"FC23 too short", {23, 0, 2, 0, 1}, 3},
      {"FC43 alone", {43}, 3},
      {"FC43 too short", {43, 14, 1}, 3},
      {"FC43 with access 0", {43, 14, 0, 0}, 3},
      {"FC43 with access 5", {43, 14, 5, 0}, 3},
  };
  for (const Case& c : cases) {
    Exchange exchange;
    INFO(c.what);
    CHECK(exchange.Handle(c.request) == Bytes{static_cast<std::uint8_t>(c.request[0] | 0x80),
                                              static_cast<std::uint8_t>(c.exception)});
    CHECK(exchange.last.wrote == PduReply::Wrote::kNothing);
    CHECK(exchange.commands.registers.values == TestCommands().registers.values);
    CHECK(exchange.commands.coils.values == TestCommands().coils.values);
  }
}

TEST_CASE("PDU: requests of maximum size", "[modbus][pdu]") {
  Exchange exchange;
  CHECK(exchange.Handle({3, 0, 100, 0, 125}).size() == 252);
  exchange.image.bits.assign(2000, 1);
  const Bytes bits = exchange.Handle({1, 0, 0, 0x07, 0xD0});
  CHECK(bits.size() == 252);
  CHECK(bits.back() == 0xFF);
  exchange.commands.registers.values.assign(123, 0);
  CHECK(exchange.Handle(Join({16, 0x03, 0xE8, 0, 123, 246}, 246, 7)).size() == 5);
  CHECK(exchange.commands.registers.values.back() == 0x0707);
}

TEST_CASE("PDU: writes are reported with their addresses", "[modbus][pdu]") {
  Exchange exchange;
  exchange.Handle({16, 0x03, 0xEA, 0, 2, 4, 1, 2, 3, 4});
  CHECK(exchange.last.wrote == PduReply::Wrote::kRegisters);
  CHECK(exchange.last.first == 1002);
  CHECK(exchange.last.count == 2);
  CHECK(exchange.commands.registers.values[2] == 0x0102);
  CHECK(exchange.commands.registers.values[3] == 0x0304);
  exchange.commands.registers.values[0] = 0x0012;
  exchange.Handle({22, 0x03, 0xE8, 0, 0xF2, 0, 0x25});
  CHECK(exchange.commands.registers.values[0] == 0x0017);  // example from the specification
  exchange.Handle({15, 0, 20, 0, 8, 1, 0xA5});
  CHECK(exchange.last.wrote == PduReply::Wrote::kCoils);
  CHECK(exchange.commands.coils.values == Bytes{1, 0, 1, 0, 0, 1, 0, 1});
  CHECK(exchange.Handle({1, 0, 20, 0, 8}) == Bytes{1, 1, 0xA5});
}

TEST_CASE("PDU: exception 04 if the image is inconsistent", "[modbus][pdu]") {
  Exchange exchange;
  exchange.image.registers.resize(10);
  CHECK(exchange.Handle({3, 0, 9, 0, 2}) == Bytes{0x83, 4});
  exchange.image.readable.reset();
  CHECK(exchange.Handle({4, 0, 0, 0, 1}) == Bytes{0x84, 4});
}

TEST_CASE("PDU: device identification by level and by object", "[modbus][pdu]") {
  Exchange exchange;
  const auto text = [](const Bytes& answer) { return std::string(answer.begin(), answer.end()); };
  const Bytes basic = exchange.Handle({43, 14, 1, 0});
  CHECK(Bytes(basic.begin(), basic.begin() + 7) == Bytes{43, 14, 1, 0x82, 0, 0, 3});
  CHECK(text(basic).find("Product") != std::string::npos);
  CHECK(text(basic).find("Model") == std::string::npos);
  CHECK(exchange.Handle({43, 14, 2, 0})[6] == 5);
  CHECK(exchange.Handle({43, 14, 3, 0})[6] == 5);
  CHECK(exchange.Handle({43, 14, 2, 3})[6] == 2);     // from this object on
  CHECK(exchange.Handle({43, 14, 2, 0x70})[6] == 5);  // unknown: from the first object
  CHECK(exchange.Handle({43, 14, 4, 2}) == Bytes{43, 14, 4, 0x82, 0, 0, 1, 2, 3, '1', '.', '0'});
}

TEST_CASE("PDU: a long identification is split and can be reassembled", "[modbus][pdu]") {
  Exchange exchange;
  exchange.identification.objects = {{0, std::string(100, 'a')},
                                     {1, std::string(100, 'b')},
                                     {2, std::string(100, 'c')},
                                     {0x80, std::string(300, 'd')}};
  std::string all;
  std::uint8_t next = 0;
  int pieces = 0;
  for (bool more = true; more; ++pieces) {
    REQUIRE(pieces < 5);
    const Bytes answer = exchange.Handle({43, 14, 3, next});
    REQUIRE(answer.size() > 7);
    CHECK(answer[3] == 0x83);
    more = answer[4] == 0xFF;
    next = answer[5];
    std::size_t place = 7;
    for (int i = 0; i < answer[6]; ++i) {
      all.append(answer.begin() + static_cast<std::ptrdiff_t>(place) + 2,
                 answer.begin() + static_cast<std::ptrdiff_t>(place) + 2 + answer[place + 1]);
      place += 2U + answer[place + 1];
    }
    CHECK(place == answer.size());
  }
  CHECK(pieces == 3);
  CHECK(all == std::string(100, 'a') + std::string(100, 'b') + std::string(100, 'c') +
                   std::string(244, 'd'));
}

TEST_CASE("ranges are sorted and merged, gaps are kept", "[modbus][image]") {
  const AddressRanges ranges({{30, 39}, {0, 9}, {10, 19}, {35, 36}, {65535, 65535}});
  CHECK(ranges.Contains(0, 20));
  CHECK(ranges.Contains(39, 1));
  CHECK(ranges.Contains(65535, 1));
  CHECK_FALSE(ranges.Contains(0, 21));
  CHECK_FALSE(ranges.Contains(19, 12));
  CHECK_FALSE(ranges.Contains(65535, 2));
  CHECK_FALSE(AddressRanges({}).Contains(0, 1));
}

}  // namespace plumbline::pdu_test
