// Robot controller with a Modbus server: reads its state and writes corrected points into it.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "drivers/robot/codec.h"
#include "drivers/robot/modbus_client.h"
#include "drivers/robot/push_codec.h"
#include "drivers/robot/robot.h"

namespace plumbline::robot {

// Rate and step limiter for corrected points that are written into the controller.

struct PushLimits {
  bool enabled = false;
  double max_step_m = 0.005;  ///< largest position change of a slot between requests or writes
  double min_period_s = 0.1;  ///< between writes of the same slot

  bool operator==(const PushLimits&) const = default;
};

/// Action to take on one slot.
struct PushDecision {
  enum class Action : std::uint8_t {
    kNothing,   ///< nothing to do
    kWrite,     ///< write the point
    kWithdraw,  ///< write sequence 0: the point became invalid
    kHold,      ///< write sequence 0: the point jumped; it is written once it is steady
  };
  Action action = Action::kNothing;
  PushPoint point;
  double step_m = 0;  ///< size of the jump, for kHold
};

/// A point is written only if it lies within max_step_m of the previous request for its slot and of
/// the position that the slot holds. A jump, or a slow drift between two writes, withdraws the
/// slot; the point is written again once two requests agree and min_period_s has passed. A single
/// wrong reading therefore never reaches the robot, and a real change is announced by the sequence
/// 0 in between. Pure; time is an input.
class PushGate {
 public:
  enum class Writes : std::uint8_t {
    kAtPeriod,      ///< a slot is written again after min_period_s
    kEveryRequest,  ///< whenever it is requested; min_period_s only delays it after a withdrawal
  };

  PushGate(int slots, const PushLimits& limits, Writes writes = Writes::kAtPeriod);

  /// Evaluates all points and returns the next action; withdrawals first, then writes round-robin.
  PushDecision Next(std::span<const PushPoint> points, double now_s);

  /// True if the slot was ever requested and may hold a valid point.
  bool MayHoldPoint(int slot) const;

  /// Records that the point was written to its slot.
  void Written(const PushPoint& point, double now_s);
  /// Records that the slot was withdrawn.
  void Withdrawn(int slot, double now_s);

  /// Marks the contents of all slots as unknown, so that everything is written again.
  void Reset();

 private:
  struct Slot {
    bool named = false;      ///< was ever requested
    bool requested = false;  ///< the last request had a valid point
    Vec3 requested_p = Vec3::Zero();
    int requested_id = 0;
    double step_m = 0;  ///< distance of the request from the previous and the written one
    bool steady = false;
    bool holds_point = true;  ///< also true if unknown
    Vec3 written_p = Vec3::Zero();
    int written_id = 0;
    double written_s = 0;
    bool ever_written = false;
  };

  void Evaluate(const PushPoint& point, Slot& slot) const;
  PushDecision Decide(const PushPoint& point, const Slot& slot, double now_s) const;

  PushLimits limits_;
  Writes writes_;
  std::vector<Slot> slots_;
  int last_slot_ = -1;
};

/// Read() sends one request per block of the profile, and closes the reading with a marker where
/// the plan has one (codec.h): on a serial line a reading counts only once its marker is
/// answered, and where joints and load come from several blocks only if the refresh counter in it
/// is still that of the beginning; otherwise all blocks are read again. Push() writes one slot:
/// sequence 0, id and pose, then reads them back, compares, and only then writes the next sequence.
/// A robot program that reads the same sequence (not 0) before and after the pose has a consistent
/// pose.
class ModbusRobot : public RobotDevice {
 public:
  static Result<std::unique_ptr<RobotDevice>> Create(const RobotProfile& profile, ReadPlan plan,
                                                     ModbusClient client, const PushLimits& limits,
                                                     Clock clock);

  LinkResult Read(model::RobotState& state) override;
  LinkResult Push(std::span<const PushPoint> points) override;
  LinkResult WithdrawAll(double within_s) override;
  std::string_view problem() const override;

 private:
  ModbusRobot(RobotCodec codec, const RobotProfile& profile, ReadPlan plan, ModbusClient client,
              const PushLimits& limits, Clock clock);

  LinkResult ReadBlocks();
  void NoteReading(double started_s, model::RobotState& state);
  LinkResult WritePoint(const PushPoint& point);
  LinkResult WriteSlot(const PushPoint& point, std::span<const std::uint16_t> wanted);
  LinkResult Withdraw(int slot);
  void NoteConnection();
  bool SamePoint(std::span<const std::uint16_t> a, std::span<const std::uint16_t> b) const;
  int FirstOf(int slot) const { return push_.first + slot * push_.stride; }
  LinkResult Refuse(LinkResult result, std::string_view text);

  RobotCodec codec_;
  ReadPlan plan_;
  ModbusClient client_;
  Clock clock_;
  std::vector<std::uint16_t> words_;
  double timestamp_s_ = 0;                ///< of the last fresh reading
  std::uint64_t sequence_ = 0;            ///< counts fresh readings
  std::optional<std::uint32_t> refresh_;  ///< controller's refresh counter in that reading

  bool can_push_ = false;
  PushProfile push_;
  PushLimits limits_;
  PushGate gate_;
  std::vector<std::uint16_t> slot_sequence_;  ///< last written, per slot; 0: unknown
  std::uint64_t connection_ = 0;              ///< number of the connection that gate_ refers to

  std::array<char, 200> problem_{};
  std::size_t problem_size_ = 0;
  bool client_problem_ = true;  ///< problem() is the client's
};

}  // namespace plumbline::robot
