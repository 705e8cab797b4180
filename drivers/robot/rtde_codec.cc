#include "drivers/robot/rtde_codec.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "firmware-like/geometry/rotation.h"

namespace plumbline::robot::rtde {
namespace {

template <typename T>
T BigEndian(Bytes bytes, std::size_t at) {
  T value = 0;
  for (std::size_t k = 0; k < sizeof(T); ++k) {
    value = static_cast<T>(static_cast<T>(value << 8) | bytes[at + k]);
  }
  return value;
}

double DoubleAt(Bytes bytes, std::size_t at) {
  return std::bit_cast<double>(BigEndian<std::uint64_t>(bytes, at));
}

std::int32_t Int32At(Bytes bytes, std::size_t at) {
  return static_cast<std::int32_t>(BigEndian<std::uint32_t>(bytes, at));
}

/// Writes big-endian numbers one after another into a buffer that is large enough.
class Writer {
 public:
  explicit Writer(std::span<std::uint8_t> buffer) : buffer_(buffer) {}

  template <typename T>
  void Add(T value) {
    for (std::size_t k = sizeof(T); k-- > 0;) {
      buffer_[at_++] = static_cast<std::uint8_t>(value >> (8 * k));
    }
  }
  void AddDouble(double value) { Add(std::bit_cast<std::uint64_t>(value)); }
  void AddInt32(std::int32_t value) { Add(static_cast<std::uint32_t>(value)); }
  void AddHeader(std::size_t size, Message type) {
    Add(static_cast<std::uint16_t>(size));
    Add(static_cast<std::uint8_t>(type));
  }
  void AddText(std::string_view text) {
    for (const char c : text) Add(static_cast<std::uint8_t>(c));
  }

 private:
  std::span<std::uint8_t> buffer_;
  std::size_t at_ = 0;
};

std::size_t BytesOfType(std::string_view type) {
  if (type == "DOUBLE") return 8;
  if (type == "VECTOR3D") return 24;
  return type == "VECTOR6D" ? 48 : 4;
}

Vec3 VectorAt(Bytes bytes, std::size_t at) {
  return {DoubleAt(bytes, at), DoubleAt(bytes, at + 8), DoubleAt(bytes, at + 16)};
}

Pose PoseAt(Bytes bytes, std::size_t at) {
  return {.R = RotationFromVector(VectorAt(bytes, at + 24)), .p = VectorAt(bytes, at)};
}

void AppendPrintable(std::string& text, Bytes bytes) {
  for (const std::uint8_t c : bytes) text += c >= ' ' && c != 0x7F ? static_cast<char>(c) : ' ';
}

}  // namespace

Frame FirstFrame(Bytes stream) {
  Frame frame;
  if (stream.size() < 2) return frame;
  frame.size = BigEndian<std::uint16_t>(stream, 0);
  if (frame.size < kHeaderBytes || frame.size > kMaxFrameBytes) {
    frame.state = Frame::State::kMalformed;
    return frame;
  }
  if (stream.size() < frame.size) return frame;
  frame.state = Frame::State::kComplete;
  frame.type = static_cast<Message>(stream[2]);
  frame.payload = stream.subspan(kHeaderBytes, frame.size - kHeaderBytes);
  return frame;
}

std::vector<std::uint8_t> MessageOf(Message type, Bytes payload) {
  std::vector<std::uint8_t> message(kHeaderBytes + payload.size());
  Writer(message).AddHeader(message.size(), type);
  std::copy(payload.begin(), payload.end(), message.begin() + kHeaderBytes);
  return message;
}

std::vector<std::uint8_t> VersionRequest(std::uint16_t version) {
  const std::array<std::uint8_t, 2> payload{static_cast<std::uint8_t>(version >> 8),
                                            static_cast<std::uint8_t>(version & 0xFF)};
  return MessageOf(Message::kVersion, payload);
}

std::vector<std::uint8_t> OutputsRequest(int version, double frequency_hz, std::string_view names) {
  std::vector<std::uint8_t> payload((version >= 2 ? 8 : 0) + names.size());
  Writer writer(payload);
  if (version >= 2) writer.AddDouble(frequency_hz);
  writer.AddText(names);
  return MessageOf(Message::kOutputs, payload);
}

std::vector<std::uint8_t> InputsRequest(std::string_view names) {
  std::vector<std::uint8_t> payload(names.size());
  Writer(payload).AddText(names);
  return MessageOf(Message::kInputs, payload);
}

std::optional<bool> Accepted(Bytes payload) {
  if (payload.size() != 1) return std::nullopt;
  return payload[0] != 0;
}

std::optional<ControllerVersion> ControllerVersionFrom(Bytes payload) {
  if (payload.size() != 16) return std::nullopt;
  return ControllerVersion{
      BigEndian<std::uint32_t>(payload, 0), BigEndian<std::uint32_t>(payload, 4),
      BigEndian<std::uint32_t>(payload, 8), BigEndian<std::uint32_t>(payload, 12)};
}

std::optional<RecipeReply> RecipeReplyFrom(Bytes payload, bool has_id) {
  RecipeReply reply;
  if (has_id) {
    if (payload.empty()) return std::nullopt;
    reply.id = payload[0];
    payload = payload.subspan(1);
  }
  std::string type;
  for (const std::uint8_t c : payload) {
    if (c != ',') {
      type += static_cast<char>(c);
      continue;
    }
    reply.types.push_back(std::move(type));
    type.clear();
  }
  if (!payload.empty()) reply.types.push_back(std::move(type));
  return reply;
}

std::optional<std::string> TextFrom(Bytes payload, int version) {
  std::string text;
  if (payload.empty()) return std::nullopt;
  if (version < 2) {
    AppendPrintable(text, payload.subspan(1));
    return text;
  }
  const std::size_t length = payload[0];
  if (payload.size() < length + 2) return std::nullopt;
  const std::size_t source = payload[1 + length];
  if (payload.size() < length + source + 3) return std::nullopt;
  AppendPrintable(text, payload.subspan(2 + length, source));
  if (source > 0) text += ": ";
  AppendPrintable(text, payload.subspan(1, length));
  return text;
}

const std::array<OutputField, kOutputs>& OutputFields() {
  static constexpr std::array<OutputField, kOutputs> kFields{{
      {Output::kTimestamp, "timestamp", "DOUBLE", true},
      {Output::kJoints, "actual_q", "VECTOR6D", true},
      {Output::kTcpPose, "actual_TCP_pose", "VECTOR6D", false},
      {Output::kTcpOffset, "tcp_offset", "VECTOR6D", false},
      {Output::kPayload, "payload", "DOUBLE", false},
      {Output::kPayloadCog, "payload_cog", "VECTOR3D", false},
      {Output::kJointTemperatures, "joint_temperatures", "VECTOR6D", false},
      {Output::kRobotMode, "robot_mode", "INT32", false},
      {Output::kRuntimeState, "runtime_state", "UINT32", false},
      {Output::kSafetyStatus, "safety_status", "INT32", false},
      {Output::kToolNumber, "output_int_register_", "INT32", true},
      {Output::kPayloadItem, "output_int_register_", "INT32", true},
  }};
  return kFields;
}

OutputLayout::OutputLayout(std::span<const Output> fields, int version, int id) {
  place_.fill(-1);
  if (version >= 2) {
    id_ = static_cast<std::uint8_t>(id);
    bytes_ = 1;
  }
  for (const Output field : fields) {
    const auto index = static_cast<std::size_t>(field);
    place_[index] = static_cast<int>(bytes_);
    bytes_ += BytesOfType(OutputFields()[index].type);
  }
}

bool OutputLayout::Fits(Bytes payload) const {
  return payload.size() == bytes_ && (!id_ || payload[0] == *id_) && Has(Output::kTimestamp) &&
         Has(Output::kJoints);
}

double OutputLayout::Timestamp(Bytes payload) const {
  return DoubleAt(payload,
                  static_cast<std::size_t>(place_[static_cast<std::size_t>(Output::kTimestamp)]));
}

void OutputLayout::RobotStateFromPackage(Bytes payload, model::RobotState& state) const {
  const auto at = [this](Output field) {
    return static_cast<std::size_t>(place_[static_cast<std::size_t>(field)]);
  };
  const auto integer = [&](Output field) -> std::optional<std::int32_t> {
    if (!Has(field)) return std::nullopt;
    return Int32At(payload, at(field));
  };
  const auto pose = [&](Output field) -> std::optional<Pose> {
    if (!Has(field)) return std::nullopt;
    return PoseAt(payload, at(field));
  };
  constexpr int kJointCount = 6;
  state.q.resize(kJointCount);
  for (int j = 0; j < kJointCount; ++j) {
    state.q[j] = DoubleAt(payload, at(Output::kJoints) + 8 * static_cast<std::size_t>(j));
  }
  state.q_resolution = 0;
  state.X_BT = pose(Output::kTcpPose);
  state.tcp_is_flange = false;
  state.X_FT = pose(Output::kTcpOffset);
  state.payload_kg.reset();
  if (Has(Output::kPayload)) state.payload_kg = DoubleAt(payload, at(Output::kPayload));
  state.payload_cog_F.reset();
  if (Has(Output::kPayloadCog)) state.payload_cog_F = VectorAt(payload, at(Output::kPayloadCog));
  state.temp_C.reset();
  if (Has(Output::kJointTemperatures)) {
    const std::size_t first = at(Output::kJointTemperatures);
    state.temp_C = (VectorAt(payload, first).sum() + VectorAt(payload, first + 24).sum()) / 6;
  }
  state.tool_number = integer(Output::kToolNumber);
  state.payload_item = integer(Output::kPayloadItem);
  std::optional<std::uint32_t> runtime;
  if (const auto value = integer(Output::kRuntimeState)) {
    runtime = static_cast<std::uint32_t>(*value);
  }
  state.mode = ModeFrom(integer(Output::kSafetyStatus), integer(Output::kRobotMode), runtime);
}

model::RobotMode ModeFrom(std::optional<std::int32_t> safety_status,
                          std::optional<std::int32_t> robot_mode,
                          std::optional<std::uint32_t> runtime_state) {
  using model::RobotMode;
  switch (safety_status.value_or(1)) {
    case 6:  // system emergency stop
    case 7:  // robot emergency stop
      return RobotMode::kEmergencyStop;
    case 3:   // protective stop
    case 5:   // safeguard stop
    case 8:   // violation
    case 9:   // fault
    case 12:  // automatic mode safeguard stop
    case 13:  // three-position enabling stop
      return RobotMode::kStopped;
    default:
      break;
  }
  constexpr std::int32_t kRunningMode = 7;
  constexpr std::uint32_t kPlaying = 2;
  if (robot_mode) return *robot_mode == kRunningMode ? RobotMode::kRunning : RobotMode::kNotReady;
  if (runtime_state == kPlaying) return RobotMode::kRunning;
  return RobotMode::kUnknown;
}

int SlotsOf(const PushRegisters& registers) {
  const int ints = (kInputRegisters - registers.first_int - 1) / kIntsPerSlot;
  const int doubles = (kInputRegisters - registers.first_double) / kDoublesPerSlot;
  return std::max(0, std::min(ints, doubles));
}

std::string InputNames(const PushRegisters& registers, int slots) {
  std::string names;
  const auto add = [&names](std::string_view type, int first, int count) {
    for (int k = first; k < first + count; ++k) {
      names += fmt::format("{}input_{}_register_{}", names.empty() ? "" : ",", type, k);
    }
  };
  add("int", registers.first_int, 1 + kIntsPerSlot * slots);
  add("double", registers.first_double, kDoublesPerSlot * slots);
  return names;
}

std::int32_t RadiusInMicrometres(double radius_m) {
  constexpr double kLargest = std::numeric_limits<std::int32_t>::max();
  if (!std::isfinite(radius_m) || radius_m <= 0) return 0;
  return static_cast<std::int32_t>(std::min(std::ceil(1e6 * radius_m), kLargest));
}

void WriteInputFrame(int recipe_id, std::int32_t heartbeat, std::span<const InputSlot> slots,
                     std::span<std::uint8_t> frame) {
  Writer writer(frame);
  writer.AddHeader(InputFrameBytes(slots.size()), Message::kData);
  writer.Add(static_cast<std::uint8_t>(recipe_id));
  writer.AddInt32(heartbeat);
  for (const InputSlot& slot : slots) {
    writer.AddInt32(slot.sequence);
    writer.AddInt32(slot.id);
    writer.AddInt32(slot.radius_um);
  }
  for (const InputSlot& slot : slots) {
    for (const double value : slot.pose) writer.AddDouble(value);
  }
}

}  // namespace plumbline::robot::rtde
