// Fuzzer: arbitrary bytes on a VISCA line.
#include <cstdint>
#include <cstdlib>

#include "drivers/zoom/visca_codec.h"

namespace {

using namespace plumbline;  // NOLINT(google-build-using-namespace)

void Require(bool condition) {
  if (!condition) std::abort();
}

void Judge(const visca::Reply& reply) {
  using Kind = visca::Reply::Kind;
  Require(reply.size <= visca::kMaxPacketBytes);
  Require(reply.address >= 0 && reply.address <= visca::kMaxCameras);
  if (reply.kind != Kind::kMalformed) Require(reply.bytes[reply.size - 1] == 0xFF);
  if (reply.kind == Kind::kError) Require(visca::ErrorText(reply.error) != nullptr);
  const auto counts = visca::PositionFrom(reply);
  Require(!counts || (reply.kind == Kind::kAnswer && *counts >= 0 && *counts <= 0xFFFF));
  lens::ZoomReading reading;
  const bool block = visca::LensBlockFrom(reply, reading);
  Require(block == reading.zoom_counts.has_value());
  Require(!block || (*reading.zoom_counts <= 0xFFFF && *reading.focus_counts <= 0xFFFF));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  visca::Receiver receiver;
  for (std::size_t i = 0; i < size; ++i) {
    const auto reply = receiver.Push(data[i]);
    Require(reply.has_value() == (data[i] == 0xFF));
    if (reply) Judge(*reply);
  }
  Judge(visca::ReplyFromPacket({data, size}));
  return 0;
}
