// Universal Robots controller over RTDE: reads its state and writes corrected points into its input
// registers.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/back_off.h"
#include "drivers/os/descriptor.h"
#include "drivers/robot/modbus_client.h"
#include "drivers/robot/modbus_robot.h"
#include "drivers/robot/robot.h"
#include "drivers/robot/rtde_codec.h"
#include "firmware-like/result.h"

namespace plumbline::robot {

inline constexpr int kRtdePort = 30004;

struct RtdeSettings {
  double frequency_hz = 125;  ///< of the packages; 125 is the highest of a CB3, 500 of later ones
  /// Optional fields that are read where the controller has them, by their RTDE names.
  std::vector<std::string> fields = {"actual_TCP_pose", "tcp_offset",         "payload",
                                     "payload_cog",     "joint_temperatures", "robot_mode",
                                     "runtime_state",   "safety_status"};
  /// Output integer registers in which the robot program keeps these numbers.
  std::optional<int> tool_number_register, payload_item_register;
  rtde::PushRegisters push;

  bool operator==(const RtdeSettings&) const = default;
};

/// Names that `fields` may contain.
std::vector<std::string_view> OptionalRtdeFields();

/// Estimates when the controller took a sample, from its own clock. A package that waited in the
/// network or in a socket is then as old as it is, not as young as its arrival.
///   t = timestamp + min over the packages (arrival - timestamp)
/// The minimum may grow by kDrift, the relative rate of two clocks. Pure.
class SampleTime {
 public:
  static constexpr double kDrift = 2e-4;

  /// @return  local time of the sample, never after `arrival_s`
  double Note(double timestamp_s, double arrival_s);
  void Reset() { least_offset_s_.reset(); }

 private:
  std::optional<double> least_offset_s_;
  double last_arrival_s_ = 0;
};

/// Read() takes everything that has arrived, decodes the newest package, and does not wait for the
/// next one; only after a connection it waits for the first. Push() sends one package with all
/// slots and the next heartbeat; the controller takes a package as a whole. The registers keep
/// their values when this program ends, so a robot program must stop using them once the heartbeat
/// stops (docs/rtde.md).
///
/// Bounded in time: a reply is awaited for the timeout or half a second, the longer of both, and a
/// reading takes at most kMaxBytesPerRead. Fields that the controller lacks are left out, if they
/// are optional. Registers that another client owns disable the push only; they are requested again
/// every kInputsRetry_s.
class RtdeRobot : public RobotDevice {
 public:
  static constexpr double kInputsRetry_s = 5;
  static constexpr std::size_t kMaxBytesPerRead = 1 << 20;

  /// @param slots  that Push() is going to use; 0: no input register is requested
  /// Fails if a field is unknown, a register does not exist, or the slots do not fit.
  static Result<std::unique_ptr<RobotDevice>> Create(const TcpAddress& address,
                                                     const RtdeSettings& settings, double timeout_s,
                                                     const PushLimits& limits, int slots,
                                                     Clock clock);

  LinkResult Read(model::RobotState& state) override;
  LinkResult Push(std::span<const PushPoint> points) override;
  LinkResult WithdrawAll(double within_s) override;
  std::string_view problem() const override { return {problem_.data(), problem_size_}; }
  std::string_view TakeNotice() override;

 private:
  RtdeRobot(const TcpAddress& address, const RtdeSettings& settings, double timeout_s,
            const PushLimits& limits, int slots, Clock clock);

  LinkResult Connect();
  LinkResult OpenSocket();
  LinkResult NegotiateVersion();
  LinkResult NoteControllerVersion();
  LinkResult SetUpOutputs();
  /// kOk also if the controller refuses the registers; inputs_problem_ then says why.
  LinkResult SetUpInputs();
  LinkResult StartOrPause(rtde::Message message);
  LinkResult RetryInputs();
  /// Sends a request and awaits the message of the same type. @param payload  of the reply; valid
  /// until the next call
  LinkResult Exchange(rtde::Bytes request, rtde::Message type, rtde::Bytes& payload);
  LinkResult Send(rtde::Bytes bytes);
  /// Receives what is there. @param count  bytes; 0: nothing more
  LinkResult Receive(std::size_t& count);
  /// The next complete message that was received.
  LinkResult Next(rtde::Frame& frame);
  void NoteText(rtde::Bytes payload);
  void NotePackage(rtde::Bytes payload);
  void ReportRate();
  void AddNotice(std::string_view text);
  LinkResult SendInputs();
  LinkResult Refuse(LinkResult result, std::string_view text);
  LinkResult Fail(LinkResult result, std::string_view text);
  LinkResult FailWith(int error);

  const TcpAddress address_;
  const RtdeSettings settings_;
  const double timeout_s_;
  const Clock clock_;
  std::string peer_;

  os::Descriptor socket_;
  BackOff back_off_;
  std::vector<std::uint8_t> received_;
  std::size_t begin_ = 0, end_ = 0;  ///< of the bytes in received_ that are not handled yet

  int version_ = 2;
  rtde::ControllerVersion controller_;
  rtde::OutputLayout layout_;
  std::string reported_fields_;  ///< the fields that a notice already named as left out

  model::RobotState state_;  ///< from the newest package
  bool fresh_ = false;       ///< a package arrived in this Read()
  bool has_package_ = false;
  std::uint64_t sequence_ = 0;
  double last_package_s_ = 0;
  double last_timestamp_s_ = 0;
  SampleTime sample_time_;
  double rate_since_s_ = 0;  ///< start of the interval in which packages are counted
  std::uint64_t packages_ = 0;

  const bool can_push_;
  const PushLimits limits_;
  PushGate gate_;
  std::vector<rtde::InputSlot> slots_;
  std::vector<std::uint8_t> input_frame_;
  int inputs_id_ = 0;  ///< 0: not accepted
  double inputs_tried_s_ = 0;
  std::array<char, 200> inputs_problem_{};
  std::size_t inputs_problem_size_ = 0;
  std::int32_t heartbeat_ = 0, last_sequence_ = 0;

  std::array<char, 240> problem_{};
  std::size_t problem_size_ = 0;
  std::string notice_, taken_notice_;
};

}  // namespace plumbline::robot
