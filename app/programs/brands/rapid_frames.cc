#include "app/programs/brands/rapid_frames.h"

#include <array>

#include "firmware-like/geometry/units.h"

namespace plumbline::programs::rapid {

namespace {

template <std::size_t kSize>
std::optional<std::array<double, kSize>> NumbersOf(const Value& value) {
  if (value.parts.size() != kSize) return std::nullopt;
  std::array<double, kSize> numbers{};
  for (std::size_t i = 0; i < kSize; ++i) {
    if (!value.parts[i].number) return std::nullopt;
    numbers[i] = value.parts[i].number->value;
  }
  return numbers;
}

bool Is(const Value& value, std::string_view word) {
  return !value.range.empty() && value.range.file->IsWord(value.range.begin, word);
}

constexpr std::string_view kNotWritten = "its value is not written out in numbers";

}  // namespace

std::optional<Pose> PoseOf(const Value& value) {
  if (value.parts.size() != 2) return std::nullopt;
  const auto p = NumbersOf<3>(value.parts[0]);
  const auto q = NumbersOf<4>(value.parts[1]);
  if (!p || !q) return std::nullopt;
  const Eigen::Quaterniond rotation((*q)[0], (*q)[1], (*q)[2], (*q)[3]);
  if (!(rotation.norm() > 0.5)) return std::nullopt;
  return Pose{rotation.normalized().toRotationMatrix(),
              Vec3((*p)[0], (*p)[1], (*p)[2]) * kMetrePerMm};
}

std::optional<LoadValue> LoadOf(const Value& value) {
  if (value.parts.size() < 2 || !value.parts[0].number) return std::nullopt;
  const auto cog = NumbersOf<3>(value.parts[1]);
  if (!cog) return std::nullopt;
  LoadValue load;
  // RobotStudio writes -1 for a tool whose mass nobody entered.
  if (value.parts[0].number->value >= 0) load.mass_kg = value.parts[0].number->value;
  load.cog_F = Vec3((*cog)[0], (*cog)[1], (*cog)[2]) * kMetrePerMm;
  return load;
}

FrameOf ToolOf(const Value& value) {
  FrameOf tool;
  const auto X = value.parts.size() == 3 ? PoseOf(value.parts[1]) : std::nullopt;
  if (!X) {
    tool.value.changes = kNotWritten;
    return tool;
  }
  tool.value.X = *X;
  tool.value.load = LoadOf(value.parts[2]);
  tool.stationary = Is(value.parts[0], "FALSE");
  return tool;
}

FrameOf WorkObjectOf(const Value& value) {
  FrameOf object;
  const bool whole = value.parts.size() == 5;
  const auto user = whole ? PoseOf(value.parts[3]) : std::nullopt;
  const auto inner = whole ? PoseOf(value.parts[4]) : std::nullopt;
  if (!user || !inner) {
    object.value.changes = kNotWritten;
    return object;
  }
  object.value.X = *user * *inner;
  object.stationary = Is(value.parts[0], "TRUE");
  if (Is(value.parts[1], "FALSE")) {
    const Range& unit = value.parts[2].range;
    object.value.changes = "moved by the mechanical unit " +
                           std::string(unit.empty() ? "" : unit.file->Text(unit.begin, unit.end));
  }
  return object;
}

}  // namespace plumbline::programs::rapid
