// Where a controller keeps what, as plain values: the register map of one make of robot.
//
// A profile is read from config/profiles/*.toml (app/config/robot_profile_reader.h), which
// documents each key. Scales here are already those of SI.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "drivers/modbus/word_order.h"
#include "firmware-like/geometry/rotation.h"
#include "firmware-like/model/robot_state.h"

namespace plumbline {

/// The four tables of Modbus; the value is the function code that reads the table.
enum class RegisterTable : std::uint8_t { kCoil = 1, kDiscrete = 2, kHolding = 3, kInput = 4 };

inline constexpr int kMaxRegistersOfRead = 125;  ///< of one request [Modbus Application Protocol]
inline constexpr int kMaxRegistersOfWrite = 123;

/// Registers read by one request, so that they belong to one moment of the controller.
/// Coils and discrete inputs arrive as one word each, 0 or 1.
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

/// How the number in a joint's register becomes the controller's count of that joint.
enum class JointWrap : std::uint8_t {
  kNone,         ///< as it stands
  kPi,           ///< 0..2 pi; a value above pi means the value minus 2 pi
  kRevolutions,  ///< modulo 2 pi, and whole turns in a register beside it
};

struct JointSignal {
  RegisterValue value;
  JointWrap wrap = JointWrap::kNone;
  RegisterValue revolutions;  ///< turns, of kRevolutions; scale -1 where they count backwards

  bool operator==(const JointSignal&) const = default;
};

/// How the controller's three angles stand for an orientation.
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

/// The state of the controller: the first bit that holds decides, else the value.
struct ModeSignal {
  struct Meaning {
    int value = 0;
    RobotMode mode = RobotMode::kUnknown;

    bool operator==(const Meaning&) const = default;
  };
  struct Bit {
    RegisterTable table = RegisterTable::kHolding;
    int address = 0;
    int bit = 0;       ///< 0 the least significant
    bool when = true;  ///< the state of the bit that means the mode
    RobotMode mode = RobotMode::kUnknown;

    bool operator==(const Bit&) const = default;
  };
  std::vector<Bit> bits;
  std::optional<RegisterValue> value;
  std::vector<Meaning> meanings;  ///< a value that is not among them is kUnknown

  bool operator==(const ModeSignal&) const = default;
};

/// Where corrected points are written: slot k begins at first + k * stride (holding registers).
/// The sequence is written last; it counts 1..65535 and 0 says that the slot holds nothing valid.
struct PushProfile {
  int first = 0;
  int slots = 0;
  int stride = 0;
  std::optional<int> id_place;  ///< of the point's id within the slot
  int pose_place = 0;           ///< of x, y, z and the three angles, one after the other
  int sequence_place = 0;
  RegisterType type = RegisterType::kInt16;
  modbus::WordOrder order = modbus::WordOrder::kAbcd;
  double position_step_m = 1e-4;  ///< written number times step = position
  double angle_step_rad = 1e-3;
  OrientationConvention orientation = OrientationConvention::kRotationVector;

  bool operator==(const PushProfile&) const = default;
};

struct RobotProfile {
  std::string name;
  std::string source;  ///< the public document that the numbers are from
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
  bool hottest_joint = false;  ///< temp_C is the largest of them instead of their mean
  std::optional<RegisterValue> tool_number;
  std::optional<RegisterValue> sequence;  ///< counted up by the controller at each refresh
  ModeSignal mode;
  std::optional<PushProfile> push;

  bool operator==(const RobotProfile&) const = default;
};

}  // namespace plumbline
