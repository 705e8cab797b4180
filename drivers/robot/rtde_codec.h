// RTDE codec: frames, handshake and data packages of Universal Robots' Real-Time Data Exchange.
// Pure.
//
// Every message is a big-endian uint16 size (header included), a uint8 type and a payload; numbers
// are big-endian, floating-point ones IEEE doubles. The robot is the server. Protocol version 2
// puts a recipe id before the types of a reply and before the fields of a package; version 1 has
// none for outputs.  [docs.universal-robots.com, RTDE guide; Universal_Robots_Client_Library 2.14]
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/robot/push_codec.h"
#include "firmware-like/model/robot_state.h"
#include "firmware-like/result.h"

namespace plumbline::robot::rtde {

enum class Message : std::uint8_t {
  kVersion = 'V',     ///< request of a protocol version
  kController = 'v',  ///< version of the controller
  kText = 'M',
  kData = 'U',
  kOutputs = 'O',  ///< recipe of what the robot sends
  kInputs = 'I',   ///< recipe of what the client writes
  kStart = 'S',
  kPause = 'P',
};

inline constexpr std::size_t kHeaderBytes = 3;
/// Longest message that is accepted. A recipe has at most 2048 bytes of names, a package fewer.
inline constexpr std::size_t kMaxFrameBytes = 8192;

using Bytes = std::span<const std::uint8_t>;

/// The first message of a byte stream.
struct Frame {
  enum class State : std::uint8_t {
    kIncomplete,  ///< more bytes are needed
    kComplete,
    kMalformed,  ///< no RTDE message starts here: its size is below 3 or above kMaxFrameBytes
  };
  State state = State::kIncomplete;
  Message type{};
  Bytes payload;
  std::size_t size = 0;  ///< of the whole message; if malformed, as stated
};
Frame FirstFrame(Bytes stream);

/// A complete message.
std::vector<std::uint8_t> MessageOf(Message type, Bytes payload = {});

std::vector<std::uint8_t> VersionRequest(std::uint16_t version);
/// @param names  separated by commas
std::vector<std::uint8_t> OutputsRequest(int version, double frequency_hz, std::string_view names);
std::vector<std::uint8_t> InputsRequest(std::string_view names);

/// The single byte of a reply to kVersion, kStart or kPause; nullopt if it has another size.
std::optional<bool> Accepted(Bytes payload);

struct ControllerVersion {
  std::uint32_t major = 0, minor = 0, bugfix = 0, build = 0;
};
std::optional<ControllerVersion> ControllerVersionFrom(Bytes payload);

/// Reply to a recipe.
struct RecipeReply {
  int id = 0;                      ///< 0: refused, or version 1
  std::vector<std::string> types;  ///< "DOUBLE", "NOT_FOUND", "IN_USE", .. in the order of names
};
/// @param has_id  version 2, and every reply to kInputs
std::optional<RecipeReply> RecipeReplyFrom(Bytes payload, bool has_id);

/// Message of the controller to people, as a line "source: text" without control characters.
/// nullopt if the lengths in it do not fit.
std::optional<std::string> TextFrom(Bytes payload, int version);

// What the robot sends.

enum class Output : std::uint8_t {
  kTimestamp,
  kJoints,
  kTcpPose,
  kTcpOffset,
  kPayload,
  kPayloadCog,
  kJointTemperatures,
  kRobotMode,
  kRuntimeState,
  kSafetyStatus,
  kToolNumber,   ///< an output_int_register that the robot program sets
  kPayloadItem,  ///< likewise
};
inline constexpr std::size_t kOutputs = 12;

struct OutputField {
  Output field;
  std::string_view name;
  std::string_view type;
  bool required;  ///< without it there is no reading
};
/// All fields that a reading may consist of; the names of the last two are prefixes of a
/// register's.
const std::array<OutputField, kOutputs>& OutputFields();

/// Where each field of an accepted recipe is in a data package.
class OutputLayout {
 public:
  /// @param fields  in the order of the recipe; the last two are found by their place only
  explicit OutputLayout(std::span<const Output> fields = {}, int version = 2, int id = 0);

  std::size_t bytes() const { return bytes_; }
  bool Has(Output field) const { return place_[static_cast<std::size_t>(field)] >= 0; }
  /// True if the package has the size and, in version 2, the recipe id of this layout.
  bool Fits(Bytes payload) const;
  /// Seconds of the controller's clock. Requires Fits().
  double Timestamp(Bytes payload) const;
  /// Decodes everything except the timestamp and sequence of `state`; fields that the recipe lacks
  /// become absent. Requires Fits(). Checks no plausibility.
  void RobotStateFromPackage(Bytes payload, model::RobotState& state) const;

 private:
  std::array<int, kOutputs> place_{};  ///< byte offset; -1: absent
  std::size_t bytes_ = 0;
  std::optional<std::uint8_t> id_;
};

/// Mode from safety_status, robot_mode and runtime_state, the first that says something.
/// Values as in Universal_Robots_Client_Library ur/datatypes.h and rtde/data_package.h.
model::RobotMode ModeFrom(std::optional<std::int32_t> safety_status,
                          std::optional<std::int32_t> robot_mode,
                          std::optional<std::uint32_t> runtime_state);

// What the client writes: corrected points in the input registers.

/// Registers from `first_int`: a heartbeat, then sequence, id and radius of each slot. Registers
/// from `first_double`: x, y, z [m] and the rotation vector [rad] of each slot.
struct PushRegisters {
  int first_int = 24;
  int first_double = 24;

  bool operator==(const PushRegisters&) const = default;
};
inline constexpr int kInputRegisters = 48;  ///< of each type, 0..47
inline constexpr int kIntsPerSlot = 3, kDoublesPerSlot = 6;

/// Slots that fit between the first registers and register 47.
int SlotsOf(const PushRegisters& registers);

/// Names of the registers that `slots` slots need, separated by commas, integers first.
std::string InputNames(const PushRegisters& registers, int slots);

/// One slot as written. Sequence 0: the point must not be used.
struct InputSlot {
  std::int32_t sequence = 0;
  std::int32_t id = 0;
  std::int32_t radius_um = 0;  ///< 95 % radius; 0: unknown
  std::array<double, 6> pose{};
};

/// Radius in whole micrometres, rounded up; 0 if it is not finite or not positive.
std::int32_t RadiusInMicrometres(double radius_m);

/// Writes the data package with all registers into `frame`.
/// @param frame  InputFrameBytes(slots.size()) bytes
void WriteInputFrame(int recipe_id, std::int32_t heartbeat, std::span<const InputSlot> slots,
                     std::span<std::uint8_t> frame);
constexpr std::size_t InputFrameBytes(std::size_t slots) {
  return kHeaderBytes + 1 + 4 + slots * (4 * kIntsPerSlot + 8 * kDoublesPerSlot);
}

}  // namespace plumbline::robot::rtde
