// Frames around the PDU: TCP (MBAP header) and RTU (address and CRC). Pure, no descriptor.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "drivers/modbus/request_handler.h"

namespace plumbline::modbus {

// ---- TCP: transaction, protocol id 0, length, unit, PDU. [Messaging on TCP/IP V1.0b, 3.1.3]

inline constexpr std::size_t kMbapBytes = 7;
inline constexpr std::size_t kMaxTcpFrameBytes = kMbapBytes + kMaxPduBytes;
inline constexpr std::size_t kMinTcpFrameBytes = kMbapBytes + 1;

struct TcpFrame {
  enum class State {
    kIncomplete,  ///< wait for more bytes
    kComplete,
    kBroken,  ///< protocol id not 0 or length outside 2..254: the stream cannot be followed further
  };
  State state = State::kIncomplete;
  std::uint16_t transaction = 0;
  std::uint8_t unit = 0;
  std::span<const std::uint8_t> pdu;
  std::size_t size = 0;  ///< bytes of the whole frame
};

/// The frame at the start of a stream that may hold several, or only a part of one.
TcpFrame CutTcpFrame(std::span<const std::uint8_t> stream);

/// The header of a frame whose PDU has `pdu_size` bytes, 1..253.
void WriteMbap(std::span<std::uint8_t, kMbapBytes> header, std::uint16_t transaction,
               std::uint8_t unit, std::size_t pdu_size);

// ---- RTU: address, PDU, CRC low byte first; frames apart by 3.5 characters of silence.
// [Modbus over Serial Line V1.02, 2.5.1]

inline constexpr std::size_t kMaxRtuFrameBytes = 256;
inline constexpr std::uint8_t kBroadcastAddress = 0;

/// CRC-16 of the serial line: x^16 + x^15 + x^2 + 1, reflected, start 0xFFFF.
std::uint16_t Crc16(std::span<const std::uint8_t> bytes);

/// The silence that ends a frame: 3.5 characters of 11 bits, 1.75 ms above 19200 baud.
double RtuSilence_s(int baud);

/// Puts address and CRC around the PDU. @return bytes of the frame
std::size_t WriteRtuFrame(std::uint8_t address, std::span<const std::uint8_t> pdu,
                          std::span<std::uint8_t, kMaxRtuFrameBytes> frame);

struct RtuFrame {
  std::uint8_t address = 0;
  std::span<const std::uint8_t> pdu;  ///< valid until the next Push or Clear
  bool newest = false;  ///< nothing follows it: its sender may still be waiting for the answer
};

/// Finds the requests for one slave in what passes on a shared line.
///
/// A frame starts only after silence or where the frame before it ended, by the length that its
/// function code tells and a right CRC, or (functions of unknown length) by silence. So neither the
/// requests to other slaves nor their replies, whatever data these carry, are taken for a request.
/// Where the chain breaks, everything up to Clear() is ignored.
class RtuReceiver {
 public:
  /// @param unit  own address, 1..247
  explicit RtuReceiver(std::uint8_t unit) : unit_(unit) {}

  /// Bytes as they come.
  void Push(std::span<const std::uint8_t> bytes);
  /// To be called at a silence until it returns nothing: the next frame for this unit or for all.
  std::optional<RtuFrame> Next();
  /// The rest will not be completed: start anew.
  void Clear();
  /// Whether bytes wait for completion.
  bool pending() const { return begin_ < end_ || overflow_; }

 private:
  std::size_t CutLength(std::span<const std::uint8_t> rest) const;

  std::uint8_t unit_;
  bool overflow_ = false;
  std::size_t begin_ = 0, end_ = 0;
  std::array<std::uint8_t, 4 * kMaxRtuFrameBytes> buffer_{};
};

}  // namespace plumbline::modbus
