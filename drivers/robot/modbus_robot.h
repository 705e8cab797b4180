// A controller that is a Modbus server: reads its state, writes corrected points back.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "drivers/robot/codec.h"
#include "drivers/robot/modbus_client.h"
#include "drivers/robot/push_gate.h"
#include "drivers/robot/robot.h"

namespace plumbline {

/// Read() sends one request for each block of the profile. Push() writes one slot:
/// sequence 0, id and pose, reads all back and compares, and only then the next sequence; a
/// program that sees the same sequence, not 0, before and after it read the pose has one pose.
class ModbusRobot : public RobotDevice {
 public:
  static Result<std::unique_ptr<RobotDevice>> Create(const RobotProfile& profile,
                                                     ModbusClient client, const PushLimits& limits,
                                                     Clock clock);

  LinkResult Read(RobotState& state) override;
  LinkResult Push(std::span<const PushPoint> points) override;
  LinkResult WithdrawAll(double within_s) override;
  std::string_view problem() const override;

 private:
  ModbusRobot(RobotCodec codec, const RobotProfile& profile, ModbusClient client,
              const PushLimits& limits, Clock clock);

  void NoteReading(RobotState& state);
  LinkResult WritePoint(const PushPoint& point);
  LinkResult WriteSlot(const PushPoint& point, std::span<const std::uint16_t> wanted);
  LinkResult Withdraw(int slot);
  void NoteConnection();
  bool SamePoint(std::span<const std::uint16_t> a, std::span<const std::uint16_t> b) const;
  int FirstOf(int slot) const { return push_.first + slot * push_.stride; }
  LinkResult Refuse(LinkResult result, std::string_view text);

  RobotCodec codec_;
  ModbusClient client_;
  Clock clock_;
  std::vector<std::uint16_t> words_;
  double timestamp_s_ = 0;                ///< of the last reading that was new
  std::uint64_t sequence_ = 0;            ///< counts them
  std::optional<std::uint32_t> refresh_;  ///< the controller's counter in it

  bool can_push_ = false;
  PushProfile push_;
  PushLimits limits_;
  PushGate gate_;
  std::vector<std::uint16_t> slot_sequence_;  ///< last written; 0: not known yet
  std::uint64_t connection_ = 0;              ///< the one that the gate knows

  std::array<char, 200> problem_{};
  std::size_t problem_size_ = 0;
  bool client_problem_ = true;  ///< the last problem is the client's
};

}  // namespace plumbline
