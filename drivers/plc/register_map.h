// The register map: one table that drives the server, config/register-map.md and the tests.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "firmware-like/geometry/rotation.h"
#include "firmware-like/snapshot.h"
#include "firmware-like/status/camera_status.h"
#include "firmware-like/status/monitoring_status.h"
#include "firmware-like/status/scene_status.h"

namespace plumbline {

/// How a register map entry stands in its registers.
enum class FieldType { kU16, kI16, kU32, kI32, kFloat, kU64 };

int RegisterCount(FieldType type);
const char* NameOf(FieldType type);

/// Who commands: the ends of the clients' IPv4 addresses (third byte high, fourth byte low), by
/// which a PLC's program recognises its own. 0: none, or the serial line.
struct PlcMasters {
  std::uint16_t executed = 0;       ///< wrote the command that was executed last
  std::uint16_t executed_port = 0;  ///< its TCP port
  std::uint16_t other = 0;          ///< commands besides; while warning::kTwoMasters stands
};

/// What the registers tell beside the snapshot.
struct PlcEnvironment {
  std::uint16_t heartbeat = 0;
  double uptime_s = 0;
  std::uint16_t clients = 0;
  std::uint16_t boot_count = 0;
  std::uint32_t firmware = 0;  ///< 10000 major + 100 minor + patch
  double cycle_period_s = 0;
  double longest_cycle_s = 0;  ///< since the start
  std::uint32_t overruns = 0;
  double now_s = 0;  ///< monotonic
  MonitoringStatus monitoring;
  PlcMasters masters;
  std::array<CameraStatus, kMostCameras> cameras;
  SceneStatus scene;
};

/// How orientations and 32-bit values stand in the map.
struct PlcConvention {
  bool little_word_first = false;  ///< CDAB instead of ABCD
  OrientationConvention orientation = OrientationConvention::kRotationVector;
};

/// Everything that an entry's value may be taken from.
struct MapSource {
  const Snapshot& snapshot;
  const PlcEnvironment& environment;
  const PlcConvention& convention;
  const PointResult* point = nullptr;  ///< of a point block
  std::uint16_t point_id = 0;
  const CameraStatus* camera = nullptr;      ///< of a camera's block
  const CameraStatus::Body* body = nullptr;  ///< of a body's block
};

/// One entry. `value` gives it in `unit`; where it is not finite the registers keep what they have.
struct MapField {
  std::uint16_t address;  ///< zero-based; in a point block: offset from the block's first register
  FieldType type;
  const char* name;
  const char* unit;
  const char* meaning;
  double (*value)(const MapSource& source);
};

/// A register that clients write.
struct CommandField {
  std::uint16_t address;
  FieldType type;
  const char* name;
  const char* unit;
  const char* meaning;
};

/// One bit of a word, by its mask.
struct BitMeaning {
  std::uint16_t mask;
  const char* meaning;
};

namespace plc_map {
inline constexpr std::uint16_t kMagic = 0x504C;  ///< "PL"
inline constexpr std::uint16_t kVersion = 1;
inline constexpr std::uint16_t kStateSize = 26;  ///< identity and state, from address 0
inline constexpr std::uint16_t kStatusWord = 11;
inline constexpr std::uint16_t kResult = 100, kResultSize = 40;
inline constexpr std::uint16_t kResultCrc = 138, kResultEnd = 139;
inline constexpr std::uint16_t kScaled = 200, kScaledSize = 20;
inline constexpr std::uint16_t kInputs = 300, kInputsSize = 52;
inline constexpr std::uint16_t kLoop = 400, kLoopSize = 28;
inline constexpr std::uint16_t kCamera = 500, kCameraSize = 25;
inline constexpr std::uint16_t kCameraStride = 200;  ///< to the next camera and its bodies
inline constexpr std::uint16_t kBodies = 540, kBodySize = 16;  ///< CameraStatus::kMostBodies blocks
inline constexpr std::uint16_t kScene = 640, kSceneSize = 10;
inline constexpr std::uint16_t kCommands = 1000, kCommandsSize = 40;
inline constexpr std::uint16_t kPoints = 2000, kPointSize = 20;
inline constexpr int kMostPoints = 1000;  ///< their blocks stay within the address space
/// The posture of each point, apart from its block, whose size PLC programs rely on.
inline constexpr std::uint16_t kPostures = 22000, kPostureSize = 32;
static_assert(kPoints + kPointSize * kMostPoints <= kPostures);
static_assert(kPostures + kPostureSize * kMostPoints <= 65536);

/// Discrete inputs (FC02; FC01 reads them too): status bits 0-15, alarms 16-31, warnings 32-47.
inline constexpr std::uint16_t kBits = 48;
/// Coils that clients write: 1000 acknowledge the result (on its rising edge), 1001 operated by
/// hand.
inline constexpr std::uint16_t kCoils = 1000, kCoilsSize = 2;

/// Bits of a validity register.
inline constexpr std::uint16_t kValid = 1 << 0;         ///< the values may be used
inline constexpr std::uint16_t kExtrapolated = 1 << 1;  ///< outside the calibrated range
inline constexpr std::uint16_t kEverValid = 1 << 2;     ///< the values are old, but were good once
inline constexpr std::uint16_t kFitsInt16 = 1 << 3;     ///< the 0.1 mm registers hold the position
inline constexpr int kBasisShift = 4;                   ///< bits 4-5: RadiusBasis of the radius
inline constexpr std::uint16_t kBasisMask = 3 << kBasisShift;
/// The basis in a validity register.
constexpr RadiusBasis BasisOf(int validity) {
  return static_cast<RadiusBasis>((validity & kBasisMask) >> kBasisShift);
}
/// Of a point: the posture is another one than `near_deg`, where the point was taught.
inline constexpr std::uint16_t kOtherPosture = 1 << 6;

/// Bits of a posture's validity register.
inline constexpr std::uint16_t kPostureValid = 1 << 0;    ///< as bit 0 of the point's block
inline constexpr std::uint16_t kPostureTaught = 1 << 1;   ///< near_deg is given
inline constexpr std::uint16_t kPostureDiffers = 1 << 2;  ///< from near_deg

/// Entries at fixed addresses, ascending.
std::span<const MapField> Fields();
/// Entries of the block of one point, offsets ascending.
std::span<const MapField> PointFields();
/// Entries of the posture block of one point, offsets ascending.
std::span<const MapField> PostureFields();
/// Bits of a posture's validity register.
std::span<const BitMeaning> PostureBits();
/// Entries of the first camera, addresses ascending; the k-th has them kCameraStride k further.
std::span<const MapField> CameraFields();
/// Entries of the block of one tracked body, offsets ascending; likewise.
std::span<const MapField> BodyFields();
/// Entries of virtual objects, addresses ascending; between the cameras' blocks.
std::span<const MapField> SceneFields();
/// Bits of a camera's register 502.
std::span<const BitMeaning> CameraBits();
std::uint16_t CameraWord(const CameraStatus& camera);
/// Register 400: the state of the monitoring, in bits.
std::uint16_t MonitoringWord(const MonitoringStatus& monitoring);
/// The flags of register 400 read back; all that the word does not hold has its default.
MonitoringStatus MonitoringFlagsFromWord(std::uint16_t word);
/// Bits of the status, alarm and warning words, ascending.
std::span<const BitMeaning> StatusBits();
std::span<const BitMeaning> AlarmBits();
std::span<const BitMeaning> WarningBits();
/// Registers of the command window.
std::span<const CommandField> Commands();
}  // namespace plc_map

}  // namespace plumbline
