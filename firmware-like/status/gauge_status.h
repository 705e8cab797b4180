// Status of the dial gauges that a person reads by their buttons.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace plumbline::status {

enum class GaugeState : std::uint16_t {
  kNone = 0,          ///< no such gauge is configured
  kConnected = 1,     ///< waiting for a press
  kConnecting = 2,    ///< not connected since the start
  kReconnecting = 3,  ///< the connection was lost
};

/// One gauge. Times are monotonic.
struct GaugeStatus {
  static constexpr std::size_t kNameSize = 24;
  GaugeState state = GaugeState::kNone;
  std::uint16_t artefact = 0;          ///< in the cell's list, from 1
  std::array<char, kNameSize> name{};  ///< of the artefact, cut to this size, filled up with zeros
  double since_s = 0;                  ///< begin of the state
  std::optional<double> reading_m;     ///< the latest, recorded or not
  double reading_s = 0;                ///< its arrival
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
