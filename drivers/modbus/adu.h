// Modbus framing (ADU) for TCP (MBAP header) and RTU (address and CRC). Pure.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "drivers/modbus/request_handler.h"

namespace plumbline::modbus {

// Check that bytes are the response to a request of this client, TCP and RTU. Pure.

/// Verdict on the bytes received so far.
struct ResponseCheck {
  enum class State {
    kIncomplete,  ///< as far as received, the response to the request; `size` bytes are needed next
    kAnswer,      ///< the whole response, and nothing else
    kException,   ///< the whole exception response to the request, with a defined code
    kMismatch,    ///< not the response to this request, however it continues
  };
  State state = State::kIncomplete;
  std::size_t size = 0;   ///< size of the message as far as it is known [bytes]; reading more than
                          ///< this would consume bytes that follow the response
  const char* what = "";  ///< kMismatch: the element that differs
  int found = 0, expected = 0;  ///< kMismatch: its values; equal if a value means nothing
  std::size_t data = 0;         ///< kAnswer to a read: offset of the register or coil bytes
  std::uint8_t exception = 0;   ///< kException: its code
};

/// Compares every element of a response that the request determines: transaction, protocol id,
/// header length, unit, function, byte count or echoed address and value, number of bytes.
/// @param request   whole message sent, function 1..6, 15 or 16; otherwise nothing is an answer
/// @param response  bytes received so far
ResponseCheck CheckTcpResponse(std::span<const std::uint8_t> request,
                               std::span<const std::uint8_t> response);

/// The same on a serial line: unit, function, byte count or echo, number of bytes, CRC. Responses
/// to two reads of one table and count are alike: the caller must keep them apart.
ResponseCheck CheckRtuResponse(std::span<const std::uint8_t> request,
                               std::span<const std::uint8_t> response);

/// Size of the PDU with which a read or write is answered [bytes]; 0: not a known request.
std::size_t AnswerPduSize(std::span<const std::uint8_t> request_pdu);

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
