// Status of the dial gauges whose reading is sent by pressing their button.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

namespace plumbline::status {

enum class GaugeState : std::uint16_t {
  kNone = 0,          ///< no such gauge is configured
  kConnected = 1,     ///< waiting for a press
  kConnecting = 2,    ///< not connected since the start
  kReconnecting = 3,  ///< the connection was lost
};

/// Outcome of the latest press.
enum class GaugeOutcome : std::uint16_t {
  kNone = 0,        ///< no press yet
  kRecorded = 1,    ///< the journal has the row
  kUnreadable = 2,  ///< no reading: the data are not in the format
  kFault = 3,       ///< no reading: the gauge reported a fault
  kContinuous = 4,  ///< not recorded: it sends without a press
  kNoAnswer = 5,    ///< not recorded: the control cycle did not answer in time
  kWaiting = 6,     ///< accepted, but not in the journal yet
  kNotKept = 7,     ///< accepted, but discarded before it was in the journal
  kRefused = 100,   ///< plus the correction::CorrectionCode with which the cycle refused it
};

/// The longest beginning of `text` that fits `size` bytes without splitting a UTF-8 character.
constexpr std::string_view CutToSize(std::string_view text, std::size_t size) {
  if (text.size() <= size) return text;
  constexpr unsigned kMask = 0xC0, kContinuation = 0x80;
  while (size > 0 && (static_cast<unsigned char>(text[size]) & kMask) == kContinuation) --size;
  return text.substr(0, size);
}

/// One gauge. Times are monotonic.
struct GaugeStatus {
  static constexpr std::size_t kNameSize = 22;
  GaugeState state = GaugeState::kNone;
  std::uint16_t artefact = 0;          ///< in the cell's list, from 1
  std::array<char, kNameSize> name{};  ///< of the artefact, cut to this size, filled up with zeros
  double since_s = 0;                  ///< begin of the state
  std::optional<double> reading_m;     ///< the latest, recorded or not
  double reading_s = 0;                ///< its arrival
  GaugeOutcome outcome = GaugeOutcome::kNone;
};

inline constexpr std::size_t kMaxGauges = 8;
using GaugeStatuses = std::array<GaugeStatus, kMaxGauges>;

constexpr const char* Describe(GaugeState state) {
  switch (state) {
    case GaugeState::kNone:
      return "none";
    case GaugeState::kConnected:
      return "connected, waiting for a press";
    case GaugeState::kConnecting:
      return "not connected yet";
    case GaugeState::kReconnecting:
      return "connection lost, reconnecting";
  }
  return "?";
}

}  // namespace plumbline::status
