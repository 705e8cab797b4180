// Fuzzer: arbitrary bytes as a TCP stream and as serial line traffic, in pieces of any size.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>

#include "drivers/modbus/adu.h"

namespace {

using namespace plumbline::modbus;  // NOLINT(google-build-using-namespace)

void Require(bool condition) {
  if (!condition) std::abort();
}

void CutTcpStream(std::span<const std::uint8_t> stream) {
  for (;;) {
    const TcpFrame frame = ParseTcpFrame(stream);
    if (frame.state != TcpFrame::State::kComplete) {
      // The server's buffer holds the longest frame, so an incomplete one must fit.
      if (frame.state == TcpFrame::State::kIncomplete) Require(stream.size() < kMaxTcpFrameBytes);
      return;
    }
    Require(frame.size >= kMinTcpFrameBytes && frame.size <= stream.size());
    Require(!frame.pdu.empty() && frame.pdu.size() <= kMaxPduBytes);
    stream = stream.subspan(frame.size);
  }
}

void ListenOnLine(std::span<const std::uint8_t> line) {
  RtuReceiver receiver(5);
  while (!line.empty()) {
    const std::size_t length = std::min<std::size_t>(line[0], line.size() - 1);
    receiver.Push(line.subspan(1, length));
    while (const auto frame = receiver.Next()) {
      Require(frame->address == 5 || frame->address == kBroadcastAddress);
      Require(!frame->pdu.empty() && frame->pdu.size() <= kMaxPduBytes);
      Require(Crc16({frame->pdu.data() - 1, frame->pdu.size() + 3}) == 0);
    }
    if (length % 3 == 0) {
      receiver.Clear();
      Require(!receiver.pending());
    }
    line = line.subspan(1 + length);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  CutTcpStream({data, size});
  ListenOnLine({data, size});
  return 0;
}
