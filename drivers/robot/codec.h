// Robot codec: decodes the raw registers of a controller into a RobotState in SI units. Pure.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "drivers/robot/profile.h"
#include "firmware-like/result.h"

namespace plumbline::robot {

// Plan of the requests that make one reading: which block first, and how the reading is closed.
// Pure.

/// Blocks in the order in which they are requested, and the markers that may close a reading.
///
/// A marker is a short read inside one of the blocks. It has two uses:
///   - On a serial line, where a response names neither its request nor its registers, the length
///     of a marker's response differs from those of all blocks, of the push slots and of the other
///     markers. The answer to a marker therefore proves that every earlier answer has arrived.
///   - Where joints and load come from several blocks, it reads the refresh counter again: if that
///     has not changed, the controller has not refreshed its registers during the reading.
struct ReadPlan {
  struct Step {
    RegisterBlock block;
    std::size_t place = 0;  ///< of its first word in the buffer of the codec
  };
  std::vector<Step> steps;             ///< the block of the refresh counter first
  std::vector<RegisterBlock> markers;  ///< used in turn; none: a reading needs no closing
  /// Joints and load lie in several blocks, and a refresh counter shows whether they belong
  /// together.
  bool compares_refresh = false;
};

/// @param serial  Modbus RTU
/// @param push    corrected points are written into the slots of the profile
ReadPlan PlanReading(const RobotProfile& profile, bool serial, bool push);

/// Why a profile cannot be read over a serial line, with the remedy: responses that cannot be told
/// apart. nullopt if it can.
std::optional<std::string> SerialFault(const RobotProfile& profile, bool push);

/// Index of the first block that contains all words of the value.
std::optional<std::size_t> BlockOf(const std::vector<RegisterBlock>& blocks,
                                   const RegisterValue& value);

/// True if one of the blocks contains all words of the value.
bool IsRead(const std::vector<RegisterBlock>& blocks, const RegisterValue& value);

/// A robot profile compiled into indices of one word buffer that holds the blocks back to back.
/// Decoding allocates nothing, cannot fail and does not check plausibility: a NaN or a joint angle
/// of 10^9 rad is decoded as such.
class RobotCodec {
 public:
  /// Compiles a profile. Fails, naming the entry, if it has no joints, a block exceeds one request,
  /// a value lies outside all blocks, or a scale is zero or not finite.
  static Result<RobotCodec> Create(const RobotProfile& profile);

  const std::vector<RegisterBlock>& blocks() const { return blocks_; }
  int word_count() const { return word_count_; }
  int joint_count() const { return static_cast<int>(joints_.size()); }

  /// Decodes everything in `state` except its timestamp and sequence.
  ///   value = scale raw + offset;  kPi: value - 2 pi if value > pi;
  ///   kRevolutions: value + 2 pi turns
  /// @param words  word_count() words, the blocks in order
  void RobotStateFromRegisters(std::span<const std::uint16_t> words,
                               model::RobotState& state) const;

  /// The controller's own refresh counter; nullopt if the profile has none.
  std::optional<std::uint32_t> RefreshCounter(std::span<const std::uint16_t> words) const;
  /// The same from the words of one read that contains it.
  std::optional<std::uint32_t> RefreshCounter(std::span<const std::uint16_t> words,
                                              const RegisterBlock& block) const;

 private:
  struct Field {
    int index = 0;  ///< index of the first word in the buffer
    RegisterType type = RegisterType::kInt16;
    modbus::WordOrder order = modbus::WordOrder::kAbcd;
    double scale = 1;
    double offset = 0;
  };
  struct JointField {
    Field value;
    JointWrap wrap = JointWrap::kNone;
    Field revolutions;
  };
  struct PoseField {
    std::array<Field, 3> position;
    std::array<Field, 3> orientation;
    ReportedOrientation convention = ReportedOrientation::kRotationVector;
  };
  struct BitField {
    int index = 0;
    int bit = 0;
    bool when = true;
    model::RobotMode mode = model::RobotMode::kUnknown;
  };
  using Words = std::span<const std::uint16_t>;

  RobotCodec() = default;
  Field Compile(const RegisterValue& value) const;
  PoseField Compile(const PoseSignal& signal) const;
  int IndexOf(RegisterTable table, int address) const;
  static double Raw(const Field& field, Words words);
  static double Value(const Field& field, Words words);
  static double JointValue(const JointField& joint, Words words);
  static Pose PoseValue(const PoseField& pose, Words words);
  double Temperature(Words words) const;
  model::RobotMode Mode(Words words) const;

  std::vector<RegisterBlock> blocks_;
  int word_count_ = 0;
  std::vector<JointField> joints_;
  double q_resolution_ = 0;
  std::optional<PoseField> tcp_;
  std::optional<PoseField> tool_offset_;
  bool tcp_is_flange_ = false;
  std::optional<Field> payload_mass_;
  std::optional<std::array<Field, 3>> payload_cog_;
  std::vector<Field> temperatures_;
  bool hottest_joint_ = false;
  std::optional<Field> tool_number_, payload_item_;
  std::optional<Field> sequence_;
  int sequence_address_ = 0;
  std::vector<BitField> mode_bits_;
  std::optional<Field> mode_value_;
  std::vector<ModeSignal::Meaning> meanings_;
};

}  // namespace plumbline::robot
