// Register map of the PLC interface: the tables that the server, docs/reference/registers.md and
// the tests use.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "firmware-like/geometry/rotation.h"
#include "firmware-like/snapshot.h"
#include "firmware-like/status/camera_status.h"
#include "firmware-like/status/gauge_status.h"
#include "firmware-like/status/monitoring_status.h"
#include "firmware-like/status/motion_link_status.h"
#include "firmware-like/status/scene_status.h"

namespace plumbline::plc {

/// Encoding of a value in its registers.
enum class FieldType { kU16, kI16, kU32, kI32, kFloat, kU64 };

const char* NameOf(FieldType type);

/// Masters that write commands, each identified by the last two bytes of its IPv4 address (third
/// byte high, fourth byte low) so that a PLC program can recognise its own. 0 for none, or for the
/// serial line.
struct PlcMasters {
  std::uint16_t executed = 0;       ///< client whose command was executed last
  std::uint16_t executed_port = 0;  ///< its TCP port
  std::uint16_t other = 0;  ///< second client that writes commands; 0 without warning::kTwoMasters
};

/// Register values that describe the daemon itself; the others come from the snapshot.
struct PlcEnvironment {
  std::uint16_t heartbeat = 0;
  double uptime_s = 0;
  std::uint16_t clients = 0;
  std::uint16_t boot_count = 0;
  std::uint32_t firmware = 0;  ///< 10000 major + 100 minor + patch
  double cycle_period_s = 0;
  double longest_cycle_s = 0;  ///< since the daemon started
  std::uint32_t overruns = 0;
  double now_s = 0;  ///< monotonic time of the encoding
  status::MonitoringStatus monitoring;
  PlcMasters masters;
  std::array<status::CameraStatus, model::kMaxCameras> cameras;
  status::SceneStatus scene;
  status::GaugeStatuses gauges;
  status::MotionLinkStatus motion_link;
};

/// Representation of orientations and 32-bit values in the map.
struct PlcConvention {
  bool little_word_first = false;  ///< CDAB instead of ABCD
  OrientationConvention orientation = OrientationConvention::kRotationVector;
};

/// All data from which the value of an entry may be computed.
struct MapSource {
  const Snapshot& snapshot;
  const PlcEnvironment& environment;
  const PlcConvention& convention;
  const PointResult* point = nullptr;  ///< the point whose block is encoded
  std::uint16_t point_id = 0;
  const status::CameraStatus* camera = nullptr;      ///< the camera whose block is encoded
  const status::CameraStatus::Body* body = nullptr;  ///< the body whose block is encoded
  const status::GaugeStatus* gauge = nullptr;        ///< the gauge whose block is encoded
};

/// One entry. `value` returns it in `unit`; if it is not finite the registers are left unchanged.
struct MapField {
  std::uint16_t address;  ///< zero-based; in a repeated block: offset from its first register
  FieldType type;
  const char* name;
  const char* unit;
  const char* meaning;
  double (*value)(const MapSource& source);
};

/// One register that clients write.
struct CommandField {
  std::uint16_t address;
  FieldType type;
  const char* name;
  const char* unit;
  const char* meaning;
};

/// One bit of a word.
struct BitMeaning {
  std::uint16_t mask;
  const char* meaning;
};

namespace registers {
inline constexpr std::uint16_t kMagic = 0x504C;  ///< "PL"
inline constexpr std::uint16_t kVersion = 1;
inline constexpr std::uint16_t kStateSize = 26;  ///< identity and state, from address 0
inline constexpr std::uint16_t kResult = 100, kResultSize = 40;
inline constexpr std::uint16_t kResultCrc = 138;
inline constexpr std::uint16_t kResultMore = 140, kResultMoreSize = 4;  ///< not in the CRC
inline constexpr std::uint16_t kScaled = 200, kScaledSize = 20;
inline constexpr std::uint16_t kInputs = 300, kInputsSize = 66;
inline constexpr std::uint16_t kMonitoring = 400, kMonitoringSize = 28;
inline constexpr std::uint16_t kCamera = 500, kCameraSize = 28;
inline constexpr std::uint16_t kWholeImage = 65535;  ///< in register 527, the usable radius
inline constexpr std::uint16_t kCameraStride = 200;  ///< from one camera to the next
inline constexpr std::uint16_t kBodies = 540, kBodySize = 16;  ///< CameraStatus::kMaxBodies blocks
inline constexpr std::uint16_t kScene = 640, kSceneSize = 10;
inline constexpr std::uint16_t kMotionLink = 660, kMotionLinkSize = 18;
inline constexpr std::uint16_t kGauges = 1100, kGaugeSize = 20;  ///< status::kMaxGauges blocks
inline constexpr std::uint16_t kCommands = 1000, kCommandsSize = 40;
inline constexpr std::uint16_t kPoints = 2000, kPointSize = 20;
inline constexpr int kMaxPoints = 1000;  ///< so that all blocks fit into the address space
/// Posture blocks, one per point; separate because PLC programs rely on kPointSize.
inline constexpr std::uint16_t kPostures = 22000, kPostureSize = 32;
static_assert(kPoints + kPointSize * kMaxPoints <= kPostures);
static_assert(kPostures + kPostureSize * kMaxPoints <= 65536);

/// Discrete inputs (FC02; FC01 reads them too): status bits 0-15, alarms 16-31, warnings 32-47.
inline constexpr std::uint16_t kBits = 48;
/// Coils that clients write: 1000 acknowledge the result (on the rising edge), 1001 manual
/// operation, 1002 corrections inside the motion are allowed.
inline constexpr std::uint16_t kCoils = 1000, kCoilsSize = 3;

/// Bits of a validity register.
inline constexpr std::uint16_t kValid = 1 << 0;         ///< the values may be used
inline constexpr std::uint16_t kExtrapolated = 1 << 1;  ///< outside the calibrated range
inline constexpr std::uint16_t kEverValid = 1 << 2;     ///< holds the last valid values
inline constexpr std::uint16_t kFitsInt16 = 1 << 3;     ///< the position fits the 0.1 mm registers
inline constexpr int kBasisShift = 4;  ///< bits 4-5: RadiusBasis of the 95 % radius
inline constexpr std::uint16_t kBasisMask = 3 << kBasisShift;
/// Basis encoded in a validity register.
constexpr model::RadiusBasis BasisOf(int validity) {
  return static_cast<model::RadiusBasis>((validity & kBasisMask) >> kBasisShift);
}
/// Point block: the posture differs from the taught one, `near_deg`.
inline constexpr std::uint16_t kPointPostureDiffers = 1 << 6;

/// Bits of the validity register of a posture block.
inline constexpr std::uint16_t kPostureValid = 1 << 0;    ///< as bit 0 of the point's block
inline constexpr std::uint16_t kPostureTaught = 1 << 1;   ///< near_deg is configured
inline constexpr std::uint16_t kPostureDiffers = 1 << 2;  ///< the posture differs from near_deg

/// Blocks at fixed addresses, in ascending order.
std::span<const MapField> StateFields();
std::span<const MapField> ResultFields();
std::span<const MapField> RobotFields();
std::span<const MapField> MonitoringFields();
/// All entries of these blocks; the first call allocates.
std::span<const MapField> Fields();
/// Entries of a point block, offsets in ascending order.
std::span<const MapField> PointFields();
/// Entries of a posture block, offsets in ascending order.
std::span<const MapField> PostureFields();
/// Bits of the validity register of a posture block.
std::span<const BitMeaning> PostureBits();
/// Entries of the first camera, addresses in ascending order; the k-th camera (from 0) has them at
/// address + kCameraStride k.
std::span<const MapField> CameraFields();
/// Entries of a tracked body's block, offsets in ascending order.
std::span<const MapField> BodyFields();
/// Entries of the virtual objects, addresses in ascending order.
std::span<const MapField> SceneFields();
/// Entries of the motion link, addresses in ascending order.
std::span<const MapField> MotionLinkFields();
/// Entries of a gauge's block, offsets in ascending order.
std::span<const MapField> GaugeFields();
/// Bits of the camera word, register 502.
std::span<const BitMeaning> CameraBits();
/// Encodes register 502.
std::uint16_t CameraWord(const status::CameraStatus& camera);
/// Encodes register 400, the monitoring state.
std::uint16_t MonitoringWord(const status::MonitoringStatus& monitoring);
/// Decodes the flags of register 400; members that the word does not contain keep their defaults.
status::MonitoringStatus MonitoringFlagsFromWord(std::uint16_t word);
/// Bits of the status, alarm and warning words, in ascending order.
std::span<const BitMeaning> StatusBits();
std::span<const BitMeaning> AlarmBits();
std::span<const BitMeaning> WarningBits();
/// Registers of the command window, in ascending order.
std::span<const CommandField> Commands();
}  // namespace registers

}  // namespace plumbline::plc
