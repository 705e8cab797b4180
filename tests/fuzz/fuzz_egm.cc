// Fuzzer: arbitrary bytes from an ABB controller.
#include <array>
#include <cstdint>
#include <cstdlib>

#include "drivers/motion/egm_codec.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace plumbline::motion_link;
  const EgmCodec codec(true);
  RobotPacket packet;
  if (!codec.Parse({reinterpret_cast<const char*>(data), size}, packet).empty()) return 0;
  if (packet.q.size() > plumbline::model::kMaxJoints || !packet.q.allFinite()) std::abort();
  if (packet.number > 0xFFFFFFFFU) std::abort();
  std::array<char, 512> answer{};
  if (codec.Encode(packet, {}, answer) > 64) std::abort();
  return 0;
}
