#include "drivers/plc/codec.h"

#include <algorithm>
#include <cmath>

#include "drivers/modbus/word_order.h"
#include "firmware-like/geometry/units.h"

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
    angles = window.Vector(CommandNamed("command_rx"), CommandNamed("command_ry"),
                           CommandNamed("command_rz"));
    if (orientation != OrientationConvention::kQuaternion) angles *= kRadPerDeg;
  }
  command.pose_valid = position_m.allFinite() && angles.allFinite() && position_m.norm() < 1e3 &&
                       angles.norm() < 100;
  if (orientation == OrientationConvention::kQuaternion) {
    constexpr double kUnitLength = 0.01;
    const double w = window.Value(CommandNamed("command_qw"));
    const double length = std::hypot(w, angles.norm());
    command.pose_valid = command.pose_valid && std::abs(length - 1) <= kUnitLength;
    angles /= w < 0 ? -length : length;
  }
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
  command.motion_enabled = (window.Word(CommandNamed("plc_flags")) & 2) != 0 || coils[2] != 0;
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

namespace {

using modbus::WordOrder;

WordOrder OrderOf(bool little_word_first) {
  return little_word_first ? WordOrder::kCdab : WordOrder::kAbcd;
}

/// Rounds to the nearest integer and saturates at the limits of the type.
template <typename Integer>
Integer Saturate(double value) {
  return static_cast<Integer>(std::clamp(std::round(value),
                                         static_cast<double>(std::numeric_limits<Integer>::min()),
                                         static_cast<double>(std::numeric_limits<Integer>::max())));
}

}  // namespace

PlcEncoder::PlcEncoder(const PlcConvention& convention, std::vector<std::uint16_t> point_ids)
    : convention_(convention),
      fields_(registers::Fields()),
      point_ids_(std::move(point_ids)),
      postures_(point_ids_.size()) {
  const std::size_t points = point_ids_.size();
  registers_.resize(points == 0 ? registers::kPoints
                                : registers::kPostures + registers::kPostureSize * points);
}

void PlcEncoder::Put(std::uint16_t address, FieldType type, double value) {
  if (!std::isfinite(value)) return;
  const auto put_pair = [&](std::size_t at, std::uint32_t word) {
    const auto pair = modbus::RegistersFromU32(word, OrderOf(convention_.little_word_first));
    registers_[at] = pair[0];
    registers_[at + 1] = pair[1];
  };
  switch (type) {
    case FieldType::kU16:
      registers_[address] = Saturate<std::uint16_t>(value);
      break;
    case FieldType::kI16:
      registers_[address] = static_cast<std::uint16_t>(Saturate<std::int16_t>(value));
      break;
    case FieldType::kU32:
      put_pair(address, Saturate<std::uint32_t>(value));
      break;
    case FieldType::kI32:
      put_pair(address, static_cast<std::uint32_t>(Saturate<std::int32_t>(value)));
      break;
    case FieldType::kFloat: {
      const auto single = static_cast<float>(value);
      if (std::isfinite(single)) put_pair(address, std::bit_cast<std::uint32_t>(single));
      break;
    }
    case FieldType::kU64: {
      const auto word = static_cast<std::uint64_t>(std::max(0.0, value));
      const auto high = static_cast<std::uint32_t>(word >> 32);
      const auto low = static_cast<std::uint32_t>(word);
      put_pair(address, convention_.little_word_first ? low : high);
      put_pair(address + 2U, convention_.little_word_first ? high : low);
      break;
    }
  }
}

const std::vector<std::uint16_t>& PlcEncoder::Encode(const Snapshot& snapshot,
                                                     const PlcEnvironment& environment) {
  MapSource source{snapshot, environment, convention_};
  for (const MapField& field : fields_) Put(field.address, field.type, field.value(source));
  for (std::size_t k = 0; k < environment.cameras.size(); ++k) EncodeCamera(source, k);
  for (const MapField& field : registers::SceneFields())
    Put(field.address, field.type, field.value(source));
  for (const MapField& field : registers::MotionLinkFields())
    Put(field.address, field.type, field.value(source));
  EncodeGauges(source);
  registers_[registers::kResultCrc] =
      CrcOfRegisters(std::span(registers_)
                         .subspan(registers::kResult, registers::kResultCrc - registers::kResult));
  for (std::size_t k = 0; k < point_ids_.size() && k < snapshot.points.size(); ++k) {
    source.point = &snapshot.points[k];
    source.point_id = point_ids_[k];
    const std::size_t base = registers::kPoints + registers::kPointSize * k;
    for (const MapField& field : registers::PointFields()) {
      Put(static_cast<std::uint16_t>(base + field.address), field.type, field.value(source));
    }
    EncodePosture(source, k);
  }
  return registers_;
}

void PlcEncoder::EncodePosture(const MapSource& source, std::size_t k) {
  const Posture current = {source.point->valid, source.point->solutions};
  if (postures_[k] == current) return;
  postures_[k] = current;
  const std::size_t base = registers::kPostures + registers::kPostureSize * k;
  for (const MapField& field : registers::PostureFields()) {
    Put(static_cast<std::uint16_t>(base + field.address), field.type, field.value(source));
  }
}

void PlcEncoder::CopyTo(std::vector<std::uint16_t>& image) const {
  image.resize(registers_.size());
  const std::size_t points_end = registers::kPoints + registers::kPointSize * point_ids_.size();
  std::copy_n(registers_.begin(), points_end, image.begin());
  if (point_ids_.empty()) return;
  std::copy(registers_.begin() + registers::kPostures, registers_.end(),
            image.begin() + registers::kPostures);
}

void PlcEncoder::EncodeGauges(MapSource source) {
  std::size_t base = registers::kGauges;
  for (const status::GaugeStatus& gauge : source.environment.gauges) {
    source.gauge = &gauge;
    for (const MapField& field : registers::GaugeFields()) {
      Put(static_cast<std::uint16_t>(base + field.address), field.type, field.value(source));
    }
    base += registers::kGaugeSize;
  }
}

void PlcEncoder::EncodeCamera(MapSource source, std::size_t camera) {
  source.camera = &source.environment.cameras[camera];
  const auto put = [&](const MapField& field, std::size_t base) {
    Put(static_cast<std::uint16_t>(base + field.address), field.type, field.value(source));
  };
  const std::size_t offset = registers::kCameraStride * camera;
  for (const MapField& field : registers::CameraFields()) put(field, offset);
  std::size_t base = registers::kBodies + offset;
  for (const status::CameraStatus::Body& body : source.camera->bodies) {
    source.body = &body;
    for (const MapField& field : registers::BodyFields()) put(field, base);
    base += registers::kBodySize;
  }
}

double ValueOfField(FieldType type, std::span<const std::uint16_t> block, std::size_t offset,
                    bool little_word_first) {
  const auto pair = [&](std::size_t at) {
    return modbus::U32FromRegisters(block[at], block[at + 1], OrderOf(little_word_first));
  };
  switch (type) {
    case FieldType::kU16:
      return block[offset];
    case FieldType::kI16:
      return static_cast<std::int16_t>(block[offset]);
    case FieldType::kU32:
      return pair(offset);
    case FieldType::kI32:
      return static_cast<std::int32_t>(pair(offset));
    case FieldType::kFloat:
      return std::bit_cast<float>(pair(offset));
    case FieldType::kU64: {
      const std::uint64_t first = pair(offset), second = pair(offset + 2);
      return static_cast<double>(little_word_first ? second << 32 | first : first << 32 | second);
    }
  }
  return 0;
}

std::uint16_t CrcOfRegisters(std::span<const std::uint16_t> registers) {
  std::uint16_t crc = 0xFFFF;
  const auto add = [&crc](std::uint8_t byte) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) {
      crc = static_cast<std::uint16_t>(crc & 1 ? (crc >> 1) ^ 0xA001 : crc >> 1);
    }
  };
  for (const std::uint16_t word : registers) {
    add(static_cast<std::uint8_t>(word >> 8));
    add(static_cast<std::uint8_t>(word & 0xFF));
  }
  return crc;
}

}  // namespace plumbline::plc
