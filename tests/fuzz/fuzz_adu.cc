// Fuzzer: arbitrary bytes as a TCP stream and as serial line traffic, in pieces of any size, and as
// request and response.
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

/// The first byte is the size of the request. A verdict on the whole must not contradict those on
/// its parts, and a response that is accepted has all elements of its request.
template <typename Check>
void CheckResponse(std::span<const std::uint8_t> bytes, Check check, std::size_t unit_at) {
  using State = ResponseCheck::State;
  if (bytes.empty()) return;
  const std::size_t size = std::min<std::size_t>(bytes[0], bytes.size() - 1);
  const auto request = bytes.subspan(1, size), response = bytes.subspan(1 + size);
  const ResponseCheck whole = check(request, response);
  for (std::size_t part = 0; part < response.size(); ++part) {
    const ResponseCheck verdict = check(request, response.first(part));
    if (verdict.state == State::kIncomplete) {
      Require(verdict.size > part && verdict.size <= kMaxTcpFrameBytes);
    } else if (verdict.state == State::kMismatch) {
      Require(whole.state == State::kMismatch);
    } else {
      Require(whole.state == State::kMismatch);  // bytes after the response
    }
  }
  if (whole.state != State::kAnswer) return;
  Require(response.size() == whole.size && whole.data < whole.size);
  Require(std::equal(response.begin(),
                     response.begin() + static_cast<std::ptrdiff_t>(unit_at == 0 ? 2 : 4),
                     request.begin()));
  Require(response[unit_at] == request[unit_at] && response[unit_at + 1] == request[unit_at + 1]);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  CutTcpStream({data, size});
  ListenOnLine({data, size});
  CheckResponse({data, size}, CheckTcpResponse, 6);
  CheckResponse({data, size}, CheckRtuResponse, 0);
  return 0;
}
