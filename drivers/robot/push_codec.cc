#include "drivers/robot/push_codec.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "firmware-like/geometry/rotation.h"

namespace plumbline::robot {
namespace {

/// Writes one number at `place`; false if it does not fit the type.
bool Put(double number, const PushProfile& profile, std::size_t place,
         std::span<std::uint16_t> words) {
  const RegisterType type = profile.type;
  if (type == RegisterType::kFloat32) {
    if (std::abs(number) > static_cast<double>(std::numeric_limits<float>::max())) return false;
    const auto pair = modbus::RegistersFromFloat(static_cast<float>(number), profile.order);
    words[place] = pair[0];
    words[place + 1] = pair[1];
    return true;
  }
  const double rounded = std::round(number);
  const bool wide = WordsOf(type) == 2;
  const bool is_signed = type == RegisterType::kInt16 || type == RegisterType::kInt32;
  const double span = wide ? 4294967296.0 : 65536.0;
  const double low = is_signed ? -span / 2 : 0;
  const double high = (is_signed ? span / 2 : span) - 1;
  if (!(rounded >= low && rounded <= high)) return false;
  const auto bits = static_cast<std::uint32_t>(static_cast<std::int64_t>(rounded));
  if (!wide) {
    words[place] = static_cast<std::uint16_t>(bits & 0xFFFF);
    return true;
  }
  const auto pair = modbus::RegistersFromU32(bits, profile.order);
  words[place] = pair[0];
  words[place + 1] = pair[1];
  return true;
}

}  // namespace

bool IsConsistent(const PushProfile& profile) {
  if (profile.slots < 1 || profile.stride < 1 || profile.stride > kMaxRegistersOfWrite ||
      profile.first < 0 || profile.first + profile.slots * profile.stride > 65536) {
    return false;
  }
  std::vector<int> uses(static_cast<std::size_t>(profile.stride), 0);
  const auto use = [&uses, &profile](int place, int count) {
    if (place < 0 || place + count > profile.stride) return false;
    for (int i = place; i < place + count; ++i) ++uses[static_cast<std::size_t>(i)];
    return true;
  };
  if (!use(profile.pose_place, PoseWordsOf(profile.type)) || !use(profile.sequence_place, 1) ||
      (profile.id_place && !use(*profile.id_place, 1))) {
    return false;
  }
  return std::all_of(uses.begin(), uses.end(), [](int count) { return count <= 1; }) &&
         std::isfinite(profile.position_step_m) && profile.position_step_m > 0 &&
         std::isfinite(profile.angle_step_rad) && profile.angle_step_rad > 0;
}

PushFit RegistersFromPush(const PushProfile& profile, const PushPoint& point,
                          std::uint16_t sequence, std::span<std::uint16_t> words) {
  if (point.slot < 0 || point.slot >= profile.slots) return PushFit::kNoSuchSlot;
  if (point.id < 0 || point.id > 65535) return PushFit::kBadId;
  const Vec3 angles = AnglesFromRotation(point.X_BT.R, profile.orientation);
  if (!point.X_BT.p.allFinite() || !point.X_BT.R.allFinite() || !angles.allFinite()) {
    return PushFit::kNotFinite;
  }
  std::fill(words.begin(), words.end(), std::uint16_t{0});
  if (profile.id_place) {
    words[static_cast<std::size_t>(*profile.id_place)] = static_cast<std::uint16_t>(point.id);
  }
  words[static_cast<std::size_t>(profile.sequence_place)] = sequence;
  for (int i = 0; i < 6; ++i) {
    const double number =
        i < 3 ? point.X_BT.p[i] / profile.position_step_m : angles[i - 3] / profile.angle_step_rad;
    const int place = profile.pose_place + i * WordsOf(profile.type);
    if (!Put(number, profile, static_cast<std::size_t>(place), words)) return PushFit::kOutOfRange;
  }
  return PushFit::kFits;
}

}  // namespace plumbline::robot
