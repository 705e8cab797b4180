// Push codec: encodes corrected points into the registers of a controller. Pure.
#pragma once

#include <cstdint>
#include <span>

#include "drivers/robot/profile.h"

namespace plumbline::robot {

/// Corrected point for the controller: the command pose of the TCP with which the loaded tool lands
/// on the assembly point.
struct PushPoint {
  int slot = 0;         ///< slot of the profile, from 0
  int id = 0;           ///< 0..65535
  Pose X_BT;            ///< command pose of the TCP in the base frame
  bool valid = false;   ///< false withdraws the slot
  double radius_m = 0;  ///< 95 % radius of the loaded tool point; 0: unknown. Not written by Modbus
};

enum class PushFit : std::uint8_t { kFits, kNoSuchSlot, kBadId, kNotFinite, kOutOfRange };

/// Encodes one slot including its sequence; unused words are 0.
///   word = round(value / step) in the profile's type; float32 holds value / step
/// A value that does not fit its type is rejected, never wrapped or clipped; the contents of
/// `words` are then unspecified.
/// @param words  profile.stride words
PushFit RegistersFromPush(const PushProfile& profile, const PushPoint& point,
                          std::uint16_t sequence, std::span<std::uint16_t> words);

/// True if the slots lie within the address space and their fields do not overlap.
bool IsConsistent(const PushProfile& profile);

}  // namespace plumbline::robot
