// Corrected points -> the words that are written into the controller's registers. Pure.
#pragma once

#include <cstdint>
#include <span>

#include "drivers/robot/profile.h"

namespace plumbline {

/// A corrected point on its way to the controller: where to command the tool point so that the
/// loaded one lands on the assembly point.
struct PushPoint {
  int slot = 0;        ///< of the profile's slots, from 0
  int id = 0;          ///< 0..65535
  Pose X_BT;           ///< what to command, in the robot's base
  bool valid = false;  ///< false withdraws the slot
};

enum class PushFit : std::uint8_t { kFits, kNoSuchSlot, kBadId, kNotFinite, kOutOfRange };

/// The words of one slot (stride of them), sequence included; places that carry nothing are 0.
///   word = round(value / step), in the profile's type; float32 carries value / step itself
/// A value that does not fit its type is refused, never wrapped or clipped; `words` is then
/// left unusable.
/// @param words  profile.stride words
PushFit RegistersFromPush(const PushProfile& profile, const PushPoint& point,
                          std::uint16_t sequence, std::span<std::uint16_t> words);

/// True where the slots lie within the registers and their contents beside each other.
bool IsSound(const PushProfile& profile);

}  // namespace plumbline
