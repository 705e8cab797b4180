// Fuzzer: arbitrary bytes from a KUKA controller.
#include <array>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "drivers/motion/rsi_codec.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace plumbline::motion_link;
  const RsiCodec codec({});
  RobotPacket packet;
  if (!codec.Parse({reinterpret_cast<const char*>(data), size}, packet).empty()) return 0;
  if (packet.q.size() > plumbline::model::kMaxJoints || !packet.q.allFinite()) std::abort();
  std::array<char, 512> answer{};
  const std::size_t written = codec.Encode(packet, {}, answer);
  if (!std::string_view(answer.data(), written).ends_with("</IPOC></Sen>")) std::abort();
  return 0;
}
