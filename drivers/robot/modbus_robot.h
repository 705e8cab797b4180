// Robot controller with a Modbus server: reads its state and writes corrected points into it.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "drivers/robot/codec.h"
#include "drivers/robot/modbus_client.h"
#include "drivers/robot/push_gate.h"
#include "drivers/robot/read_plan.h"
#include "drivers/robot/robot.h"

namespace plumbline::robot {

/// Read() sends one request per block of the profile, and closes the reading with a marker where
/// the plan has one (read_plan.h): on a serial line a reading counts only once its marker is
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
