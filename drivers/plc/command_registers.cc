#include "drivers/plc/command_registers.h"

#include <cmath>

#include "drivers/plc/codec.h"
#include "firmware-like/geometry/angle.h"
#include "firmware-like/geometry/length.h"

namespace plumbline::plc {
namespace {

constexpr double kMetrePerScaled = 1e-4, kRadianPerScaled = 1e-3, kMetrePerFine = 1e-6;

/// Access to the command window by register name.
class CommandWindow {
 public:
  CommandWindow(std::span<const std::uint16_t> window, bool little_word_first)
      : window_(window), little_word_first_(little_word_first) {}

  double Value(const CommandField& field) const {
    const auto offset = static_cast<std::size_t>(field.address - registers::kCommands);
    return ValueOfField(field.type, window_, offset, little_word_first_);
  }
  std::uint16_t Word(const CommandField& field) const {
    return static_cast<std::uint16_t>(Value(field));
  }
  Vec3 Vector(const CommandField& x, const CommandField& y, const CommandField& z) const {
    return {Value(x), Value(y), Value(z)};
  }

 private:
  std::span<const std::uint16_t> window_;
  bool little_word_first_;
};

/// Decodes the pose, or the measured tip of a probe, and marks the pose valid if it is plausible.
void ReadPose(const CommandWindow& window, const PlcConvention& convention,
              model::PlcCommand& command) {
  Vec3 position_m, angles;
  OrientationConvention orientation = convention.orientation;
  if (command.code == model::PlcCommandCode::kCorrectPoseScaled) {
    position_m = kMetrePerScaled * window.Vector(CommandNamed("command_x_scaled"),
                                                 CommandNamed("command_y_scaled"),
                                                 CommandNamed("command_z_scaled"));
    angles = kRadianPerScaled * window.Vector(CommandNamed("command_rx_scaled"),
                                              CommandNamed("command_ry_scaled"),
                                              CommandNamed("command_rz_scaled"));
    orientation = OrientationConvention::kRotationVector;
  } else {
    position_m = kMetrePerMm * window.Vector(CommandNamed("command_x"), CommandNamed("command_y"),
                                             CommandNamed("command_z"));
    angles = kRadPerDeg * window.Vector(CommandNamed("command_rx"), CommandNamed("command_ry"),
                                        CommandNamed("command_rz"));
  }
  command.pose_valid = position_m.allFinite() && angles.allFinite() && position_m.norm() < 1e3 &&
                       angles.norm() < 100;
  if (command.pose_valid) command.X_BP = {RotationFromAngles(angles, orientation), position_m};
  if (command.code == model::PlcCommandCode::kProbe && position_m.allFinite()) {
    command.probe_W = position_m;
  }
  if (command.code == model::PlcCommandCode::kProbeReading && std::isfinite(position_m.x())) {
    command.reading_m = position_m.x();
  }
}

}  // namespace

std::span<const CommandField> registers::Commands() {
  return kCommandFields;
}

model::PlcCommand PlcCommandFromRegisters(std::span<const std::uint16_t> registers,
                                          std::span<const std::uint8_t> coils,
                                          const PlcConvention& convention) {
  const CommandWindow window(registers, convention.little_word_first);
  model::PlcCommand command;
  command.sequence = window.Word(CommandNamed("command_sequence"));
  command.code = static_cast<model::PlcCommandCode>(window.Word(CommandNamed("command_code")));
  command.point_id = window.Word(CommandNamed("command_point"));
  command.camera = window.Word(CommandNamed("command_camera"));
  command.heartbeat = window.Word(CommandNamed("plc_heartbeat"));
  command.acknowledge = coils[0] != 0;
  command.manual = (window.Word(CommandNamed("plc_flags")) & 1) != 0 || coils[1] != 0;
  const double payload_kg = window.Value(CommandNamed("command_payload"));
  if (!(payload_kg <= 0))
    command.payload_kg = payload_kg;  // passes NaN on, which the machine refuses
  ReadPose(window, convention, command);
  if (command.code == model::PlcCommandCode::kProbeFine) {
    command.probe_W =
        kMetrePerFine * window.Vector(CommandNamed("probe_x_fine"), CommandNamed("probe_y_fine"),
                                      CommandNamed("probe_z_fine"));
  }
  return command;
}

}  // namespace plumbline::plc
