// Codec of a sensor interface: a controller's datagram <-> values. Pure; does not allocate.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "firmware-like/model/cell_model.h"
#include "firmware-like/motion_offset/motion_offset.h"
#include "firmware-like/result.h"

namespace plumbline::motion_link {

/// What a controller sends once per cycle.
struct RobotPacket {
  std::uint64_t number = 0;  ///< IPOC of RSI, seqno of EGM; echoed in the answer
  std::uint64_t time = 0;    ///< tm of EGM [ms]; echoed
  bool running = true;       ///< the controller applies corrections
  model::JointVector q;      ///< actual joints [rad]; empty if they are missing or not finite
  std::optional<std::uint64_t> late;  ///< answers that were late, as the controller counts them
};

class MotionCodec {
 public:
  MotionCodec() = default;
  MotionCodec(const MotionCodec&) = delete;
  MotionCodec& operator=(const MotionCodec&) = delete;
  virtual ~MotionCodec() = default;

  /// @return  empty if `packet` is complete; otherwise why the datagram is none of a controller's
  virtual std::string_view Parse(std::string_view datagram, RobotPacket& packet) const = 0;
  /// Writes the answer to a packet. @return  its size
  virtual std::size_t Encode(const RobotPacket& packet, const motion_offset::Offset& offset,
                             std::span<char, 512> answer) const = 0;
};

/// Names in the XML of RSI, which the controller's Ethernet configuration decides.
struct RsiNames {
  std::string sen_type = "ImFree";       ///< SENTYPE
  std::string joints_tag = "AIPos";      ///< attributes A1, A2, .. [deg]
  std::string correction_tag = "RKorr";  ///< attributes X, Y, Z [mm], A, B, C [deg]

  bool operator==(const RsiNames&) const = default;
};

struct CodecSettings {
  RsiNames rsi;
  bool egm_needs_running = true;  ///< mciState must be RUNNING for packet.running; else not ERROR

  bool operator==(const CodecSettings&) const = default;
};

/// @param kind  "rsi" or "egm"
Result<std::unique_ptr<MotionCodec>> MakeMotionCodec(std::string_view kind,
                                                     const CodecSettings& settings);

}  // namespace plumbline::motion_link
