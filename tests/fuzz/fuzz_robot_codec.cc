// Fuzzer: any profile accepted by the reader decodes any registers, so reader and codec agree on
// what a valid profile is, and no register image crashes the decoder or the push.
#include <cstdint>
#include <cstdlib>
#include <string_view>
#include <vector>

#include "app/base/config/robot_profile_reader.h"
#include "drivers/robot/codec.h"
#include "drivers/robot/push_codec.h"

namespace {

using plumbline::robot::RobotProfile;

/// Fixed profile with every kind of value, so that decoding is reached immediately.
constexpr std::string_view kProfile = R"(schema = 1
name = "fuzz"
source = "none"
[[read]]
table = "holding"
first = 0
count = 40
[[joints]]
table = "holding"
address = [0, 2, 4]
type = "float32"
word_order = "DCBA"
unit = "deg"
wrap = "pi"
[[joints]]
table = "holding"
address = [6, 7]
type = "uint16"
unit = "mrad"
wrap = "revolutions"
revolutions = [8, 9]
[tcp]
[tcp.position]
table = "holding"
address = [10, 12, 14]
type = "float32"
unit = "mm"
[tcp.orientation]
table = "holding"
address = [16, 18, 20]
type = "float32"
unit = "rad"
convention = "rotation_vector"
[temperature]
table = "holding"
address = [22, 24]
type = "float32"
unit = "K"
[tool_number]
table = "holding"
address = [26]
type = "uint32"
[sequence]
table = "holding"
address = [28]
type = "int32"
[mode]
table = "holding"
address = [30]
type = "int32"
running = [1]
[push]
first = 0
slots = 1
stride = 8
pose_place = 0
sequence_place = 6
type = "int16"
position_step_mm = 0.1
angle_step_mrad = 1.0
convention = "abc"
)";

void Decode(const RobotProfile& profile, const std::uint8_t* data, std::size_t size) {
  const auto codec = plumbline::robot::RobotCodec::Create(profile);
  if (!codec) std::abort();  // the reader accepted what the codec rejects
  std::vector<std::uint16_t> words(static_cast<std::size_t>(codec->word_count()));
  for (std::size_t i = 0; i < words.size() && size > 1; ++i) {
    const std::size_t at = 2 * i % (size - 1);
    words[i] = static_cast<std::uint16_t>(data[at] << 8 | data[at + 1]);
  }
  plumbline::model::RobotState state;
  codec->RobotStateFromRegisters(words, state);
  static_cast<void>(codec->RefreshCounter(words));
  if (!profile.push || !state.X_BT) return;
  plumbline::robot::PushPoint point;
  point.X_BT = *state.X_BT;
  std::vector<std::uint16_t> slot(static_cast<std::size_t>(profile.push->stride));
  static_cast<void>(plumbline::robot::RegistersFromPush(*profile.push, point, 1, slot));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  plumbline::config::FaultList faults;
  static const auto fixed = plumbline::config::RobotProfileFromText(kProfile, "fixed", faults);
  if (!fixed) std::abort();
  Decode(*fixed, data, size);
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  if (const auto profile = plumbline::config::RobotProfileFromText(text, "fuzz", faults)) {
    Decode(*profile, data, size);
  }
  return 0;
}
