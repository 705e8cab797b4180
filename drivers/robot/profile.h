// Robot profile: the register map of one controller family, as plain values.
//
// Profiles are read from config/profiles/*.toml by app/base/config/robot_profile_reader.h, which
// documents each key. Scales are already converted to SI.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "drivers/modbus/word_order.h"
#include "firmware-like/geometry/rotation.h"
#include "firmware-like/model/robot_state.h"

namespace plumbline::robot {

/// The four Modbus tables; the value is the function code that reads the table.
enum class RegisterTable : std::uint8_t { kCoil = 1, kDiscrete = 2, kHolding = 3, kInput = 4 };

inline constexpr int kMaxRegistersOfRead = 125;  ///< per request [Modbus Application Protocol]
inline constexpr int kMaxRegistersOfWrite = 123;

/// Registers read in one request, hence sampled by the controller at one instant. Coils and
/// discrete inputs take one word each, 0 or 1.
struct RegisterBlock {
  RegisterTable table = RegisterTable::kHolding;
  int first = 0;
  int count = 0;  ///< 1..kMaxRegistersOfRead

  bool operator==(const RegisterBlock&) const = default;
};

enum class RegisterType : std::uint8_t { kInt16, kUint16, kInt32, kUint32, kFloat32 };

constexpr int WordsOf(RegisterType type) {
  return type == RegisterType::kInt16 || type == RegisterType::kUint16 ? 1 : 2;
}

/// Registers of a pushed pose: x, y, z and three angles.
constexpr int PoseWordsOf(RegisterType type) {
  return 6 * WordsOf(type);
}

/// One value: scale * raw + offset, in SI (temperatures in degree Celsius).
struct RegisterValue {
  RegisterTable table = RegisterTable::kHolding;
  int address = 0;
  RegisterType type = RegisterType::kInt16;
  modbus::WordOrder order = modbus::WordOrder::kAbcd;
  double scale = 1;
  double offset = 0;

  bool operator==(const RegisterValue&) const = default;
};

/// Conversion of a wrapped joint register value to the joint position.
enum class JointWrap : std::uint8_t {
  kNone,         ///< not wrapped
  kPi,           ///< 0..2 pi; values above pi mean value - 2 pi
  kRevolutions,  ///< modulo 2 pi, whole turns in a second register
};

struct JointSignal {
  RegisterValue value;
  JointWrap wrap = JointWrap::kNone;
  RegisterValue revolutions;  ///< turns, for kRevolutions; scale -1 if counted backwards

  bool operator==(const JointSignal&) const = default;
};

/// Convention of the three angles that the controller reports.
enum class ReportedOrientation : std::uint8_t {
  kRotationVector,
  kRollPitchYaw,  ///< R = Rz(3rd) Ry(2nd) Rx(1st)
  kAbc,           ///< R = Rz(1st) Ry(2nd) Rx(3rd)
  kZyz,           ///< R = Rz(1st) Ry(2nd) Rz(3rd)
};

struct PoseSignal {
  std::array<RegisterValue, 3> position;     ///< [m]
  std::array<RegisterValue, 3> orientation;  ///< [rad]
  ReportedOrientation convention = ReportedOrientation::kRotationVector;

  bool operator==(const PoseSignal&) const = default;
};

/// Operating mode of the controller: the first matching bit decides, otherwise the value.
struct ModeSignal {
  struct Meaning {
    int value = 0;
    model::RobotMode mode = model::RobotMode::kUnknown;

    bool operator==(const Meaning&) const = default;
  };
  struct Bit {
    RegisterTable table = RegisterTable::kHolding;
    int address = 0;
    int bit = 0;       ///< 0: least significant
    bool when = true;  ///< bit state that indicates the mode
    model::RobotMode mode = model::RobotMode::kUnknown;

    bool operator==(const Bit&) const = default;
  };
  std::vector<Bit> bits;
  std::optional<RegisterValue> value;
  std::vector<Meaning> meanings;  ///< any other value is kUnknown

  bool operator==(const ModeSignal&) const = default;
};

/// Holding registers that receive corrected points: slot k starts at first + k * stride. The
/// sequence is written last; it counts 1..65535, and 0 marks the slot as invalid.
struct PushProfile {
  int first = 0;
  int slots = 0;
  int stride = 0;
  std::optional<int> id_place;  ///< offset of the point id within the slot
  int pose_place = 0;           ///< offset of x, y, z and the three angles
  int sequence_place = 0;
  RegisterType type = RegisterType::kInt16;
  modbus::WordOrder order = modbus::WordOrder::kAbcd;
  double position_step_m = 1e-4;  ///< position = register value * step
  double angle_step_rad = 1e-3;
  OrientationConvention orientation = OrientationConvention::kRotationVector;

  bool operator==(const PushProfile&) const = default;
};

struct RobotProfile {
  std::string name;
  std::string source;  ///< public document that the addresses are taken from
  int port = 502;
  int unit_id = 1;

  std::vector<RegisterBlock> blocks;
  std::vector<JointSignal> joints;  ///< 1..kMaxJoints, first joint first; [rad] or [m]
  std::optional<PoseSignal> tcp;
  bool tcp_is_flange = false;
  std::optional<PoseSignal> tool_offset;
  std::optional<RegisterValue> payload_mass;                ///< [kg]
  std::optional<std::array<RegisterValue, 3>> payload_cog;  ///< in F [m]
  std::vector<RegisterValue> temperatures;                  ///< [degree C]
  bool hottest_joint = false;  ///< temp_C is their maximum instead of their mean
  std::optional<RegisterValue> tool_number;
  std::optional<RegisterValue> payload_item;
  std::optional<RegisterValue> sequence;  ///< incremented by the controller at each refresh
  ModeSignal mode;
  std::optional<PushProfile> push;

  bool operator==(const RobotProfile&) const = default;
};

}  // namespace plumbline::robot
