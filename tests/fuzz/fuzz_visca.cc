// Fuzzer: arbitrary bytes on a VISCA line, in a datagram, and as the address of a camera.
#include <cstdint>
#include <cstdlib>

#include "drivers/zoom/visca_address.h"
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

void JudgeDatagram(const visca::DatagramReply& found) {
  using Kind = visca::DatagramReply::Kind;
  Require((found.kind == Kind::kReply) == (found.reply.kind != visca::Reply::Kind::kMalformed));
  Judge(found.reply);
}

/// An accepted address has a host and a port, and its text is the same address.
void JudgeAddress(std::string_view text) {
  const auto address = visca::AddressFrom(text, "");
  if (!address) return Require(!address.error().empty());
  Require(!address->host.empty());
  if (address->transport == visca::Transport::kSerial) return;
  Require(address->port >= 1 && address->port <= 65535);
  const auto again = visca::AddressFrom(address->Text(), "");
  Require(again && again->Text() == address->Text());
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
  JudgeDatagram(visca::ReplyFromDatagram({data, size}));
  JudgeAddress({reinterpret_cast<const char*>(data), size});
  return 0;
}
