// Modbus framing (ADU) for TCP (MBAP header) and RTU (address and CRC). Pure.
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
    kIncomplete,  ///< more bytes are needed
    kComplete,
    kBroken,  ///< protocol id not 0 or length outside 2..254: framing is lost, close the connection
  };
  State state = State::kIncomplete;
  std::uint16_t transaction = 0;
  std::uint8_t unit = 0;
  std::span<const std::uint8_t> pdu;
  std::size_t size = 0;  ///< of the whole frame [bytes]
};

/// Parses the frame at the start of `stream`, which may hold several frames or only part of one.
TcpFrame ParseTcpFrame(std::span<const std::uint8_t> stream);

/// Writes the header of a frame whose PDU has `pdu_size` bytes, 1..253.
void WriteMbap(std::span<std::uint8_t, kMbapBytes> header, std::uint16_t transaction,
               std::uint8_t unit, std::size_t pdu_size);

// ---- RTU: address, PDU, CRC low byte first; frames are separated by 3.5 characters of silence.
// [Modbus over Serial Line V1.02, 2.5.1]

inline constexpr std::size_t kMaxRtuFrameBytes = 256;
inline constexpr std::uint8_t kBroadcastAddress = 0;

/// CRC-16/MODBUS: x^16 + x^15 + x^2 + 1, reflected, initial value 0xFFFF.
std::uint16_t Crc16(std::span<const std::uint8_t> bytes);

/// Silence that ends a frame [s]: 3.5 characters of 11 bits, but 1.75 ms above 19200 baud.
double RtuSilence_s(int baud);

/// Adds address and CRC to the PDU. @return size of the frame [bytes]
std::size_t WriteRtuFrame(std::uint8_t address, std::span<const std::uint8_t> pdu,
                          std::span<std::uint8_t, kMaxRtuFrameBytes> frame);

struct RtuFrame {
  std::uint8_t address = 0;
  std::span<const std::uint8_t> pdu;  ///< valid until the next Push or Clear
  bool newest = false;  ///< no bytes follow: the master may still be waiting for the reply
};

/// Extracts the requests for one slave from the traffic on a shared line.
///
/// A frame starts after silence or directly after the previous frame. It ends at the length implied
/// by its function code if the CRC matches, or, for functions of unknown length, at silence. So
/// requests to other slaves and their replies are never mistaken for a request, whatever data they
/// carry. If no valid frame is found, all input is ignored until Clear().
class RtuReceiver {
 public:
  /// @param unit  own address, 1..247
  explicit RtuReceiver(std::uint8_t unit) : unit_(unit) {}

  /// Appends received bytes.
  void Push(std::span<const std::uint8_t> bytes);
  /// Next frame for this unit or a broadcast. Call it after a silence until it returns nullopt.
  std::optional<RtuFrame> Next();
  /// Discards an incomplete frame.
  void Clear();
  /// True if an incomplete frame is buffered.
  bool pending() const { return begin_ < end_ || overflow_; }

 private:
  std::size_t FrameLength(std::span<const std::uint8_t> rest) const;

  std::uint8_t unit_;
  bool overflow_ = false;
  std::size_t begin_ = 0, end_ = 0;
  std::array<std::uint8_t, 4 * kMaxRtuFrameBytes> buffer_{};
};

}  // namespace plumbline::modbus
