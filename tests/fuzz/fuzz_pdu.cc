// Fuzzer: arbitrary bytes as a sequence of requests (a length byte, then the PDU) to one device.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>

#include "drivers/modbus/pdu.h"
#include "tests/drivers/modbus/test_image.h"

using plumbline::modbus::PduReply;

namespace {

void Require(bool condition) {
  if (!condition) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace plumbline::modbus;
  static const RegisterImage image = TestImage();
  static const DeviceIdentification identification = TestIdentification();
  CommandArea commands = TestCommands();
  std::span<const std::uint8_t> rest(data, size);
  while (!rest.empty()) {
    const std::size_t length = std::min<std::size_t>(rest[0], rest.size() - 1);
    const auto request = rest.subspan(1, length);
    rest = rest.subspan(1 + length);
    const CommandArea before = commands;
    std::array<std::uint8_t, kMaxPduBytes> response;
    const PduReply reply = HandlePdu(request, image, commands, identification, response);
    Require((reply.size == 0) == request.empty() && reply.size <= kMaxPduBytes);
    if (reply.wrote == PduReply::Wrote::kNothing) {
      Require(commands.registers.values == before.registers.values);
      Require(commands.coils.values == before.coils.values);
    }
    if (request.empty()) continue;
    Require((response[0] & 0x7F) == (request[0] & 0x7F) && reply.size >= 2);
    if (response[0] != request[0]) {
      Require(reply.wrote == PduReply::Wrote::kNothing && reply.size == 2);
      Require(response[1] >= 1 && response[1] <= 3);
    }
  }
  return 0;
}
