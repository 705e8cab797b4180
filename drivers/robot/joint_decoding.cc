#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "drivers/robot/decoding_search.h"
#include "firmware-like/geometry/units.h"

namespace plumbline::robot {
namespace {

constexpr JointUnit kJointUnits[] = {
    {"deg", 1, kRadPerDeg, 1e-3, "deg", true, false},
    {"rad", 1, 1, 1, "rad", true, false},
    {"mrad", 1, 1e-3, 1e-3, "mrad", false, true},
    {"deg", 0.1, 0.1 * kRadPerDeg, 1e-4, "0.1 deg", false, true},
    {"deg", 0.01, 0.01 * kRadPerDeg, 1e-5, "0.01 deg", false, true},
    {"mrad", 0.1, 1e-4, 1e-4, "0.1 mrad", false, true},
    {"deg", 0.001, 0.001 * kRadPerDeg, 1e-6, "0.001 deg", false, false},
    {"deg", 0.0001, 0.0001 * kRadPerDeg, 1e-7, "0.0001 deg", false, false},
    {"urad", 10, 1e-5, 1e-5, "10 urad", false, false},
    {"urad", 1, 1e-6, 1e-6, "urad", false, false},
};

constexpr double kOneTurn = 2 * std::numbers::pi;

}  // namespace

void RegisterImage::Set(int first, std::span<const std::uint16_t> read) {
  for (const std::uint16_t word : read) words[first++] = word;
}

bool RegisterImage::Has(int first, int count) const {
  for (int k = 0; k < count; ++k) {
    if (!words.contains(first + k) || (k > 0 && starts.contains(first + k))) return false;
  }
  return true;
}

std::optional<double> RegisterImage::TimeOf(int address) const {
  const auto after = read_s.upper_bound(address);
  if (after == read_s.begin()) return std::nullopt;
  return std::prev(after)->second;
}

std::span<const JointUnit> JointUnits() {
  return kJointUnits;
}

const char* NameOf(RegisterType type) {
  constexpr const char* kNames[] = {"int16", "uint16", "int32", "uint32", "float32"};
  return kNames[static_cast<int>(type)];
}

const char* NameOf(modbus::WordOrder order) {
  constexpr const char* kNames[] = {"ABCD", "CDAB", "BADC", "DCBA"};
  return kNames[static_cast<int>(order)];
}

const char* NameOf(RegisterTable table) {
  constexpr const char* kNames[] = {"?", "coil", "discrete", "holding", "input"};
  return kNames[static_cast<int>(table)];
}

const char* NameOf(ReportedOrientation convention) {
  constexpr const char* kNames[] = {"rotation_vector", "roll_pitch_yaw", "abc", "zyz"};
  return kNames[static_cast<int>(convention)];
}

namespace {

std::string TypeText(RegisterType type, modbus::WordOrder order) {
  return WordsOf(type) == 1 ? std::string(NameOf(type))
                            : fmt::format("{} {}", NameOf(type), NameOf(order));
}

}  // namespace

std::string TextOf(const JointDecoding& decoding) {
  std::string text =
      fmt::format("{} in {} at {} {}", TypeText(decoding.type, decoding.order), decoding.unit->text,
                  NameOf(decoding.table), fmt::join(decoding.addresses, ", "));
  if (decoding.wrap == JointWrap::kPi) text += ", modulo one turn";
  if (decoding.wrap == JointWrap::kRevolutions) {
    text += fmt::format(", modulo one turn with whole turns at {}",
                        fmt::join(decoding.revolutions, ", "));
  }
  return text;
}

std::string TextOf(const PoseDecoding& pose) {
  return fmt::format("pose of the {}, {} in {:g} {} at {} and {:g} {} at {}, {}",
                     pose.of_flange ? "flange" : "tool", TypeText(pose.type, pose.order),
                     pose.length_scale, pose.length_unit, fmt::join(pose.position, ", "),
                     pose.angle_scale, pose.angle_unit, fmt::join(pose.orientation, ", "),
                     NameOf(pose.convention));
}

std::string JointsText(const kinematics::Chain& chain, const model::JointVector& q) {
  std::string text;
  bool slides = false;
  for (int j = 0; j < q.size(); ++j) {
    const bool slide = j < chain.size() && chain.type(j) == model::JointType::kPrismatic;
    const double shown = slide ? kMmPerMetre * q[j] : kDegPerRad * q[j];
    // Rounding after the sixth digit, but no 1e-05 where a joint is at zero.
    const double rounded = std::abs(shown) < 1e4 && std::abs(shown) > 1e-20
                               ? std::round(1e4 * shown) / 1e4 + 0.0
                               : shown;
    text += fmt::format("{}{:.7g}{}", j == 0 ? "" : ", ", rounded, slide ? " mm" : "");
    slides = slides || slide;
  }
  return text + (slides ? " (deg where not mm)" : " deg");
}

double RawValue(RegisterType type, modbus::WordOrder order, std::uint16_t first,
                std::uint16_t second) {
  switch (type) {
    case RegisterType::kInt16:
      return static_cast<std::int16_t>(first);
    case RegisterType::kUint16:
      return first;
    case RegisterType::kInt32:
      return static_cast<std::int32_t>(modbus::U32FromRegisters(first, second, order));
    case RegisterType::kUint32:
      return modbus::U32FromRegisters(first, second, order);
    case RegisterType::kFloat32:
      break;
  }
  return static_cast<double>(modbus::FloatFromRegisters(first, second, order));
}

std::optional<double> RawAt(const RegisterImage& image, RegisterType type, modbus::WordOrder order,
                            int address) {
  const auto first = image.words.find(address);
  if (first == image.words.end()) return std::nullopt;
  if (WordsOf(type) == 1) return RawValue(type, order, first->second, 0);
  const auto second = image.words.find(address + 1);
  if (second == image.words.end()) return std::nullopt;
  return RawValue(type, order, first->second, second->second);
}

std::optional<model::JointVector> Decoded(const JointDecoding& decoding,
                                          const kinematics::Chain& chain,
                                          const RegisterImage& image) {
  model::JointVector q(static_cast<int>(decoding.addresses.size()));
  for (int j = 0; j < q.size(); ++j) {
    const auto place = static_cast<std::size_t>(j);
    const auto raw = RawAt(image, decoding.type, decoding.order, decoding.addresses[place]);
    if (!raw) return std::nullopt;
    const bool turns = chain.type(j) == model::JointType::kRevolute;
    q[j] = *raw * (turns ? decoding.unit->rad : decoding.unit->m);
    if (!turns) continue;
    if (decoding.wrap == JointWrap::kPi && q[j] > std::numbers::pi) q[j] -= kOneTurn;
    if (decoding.wrap == JointWrap::kRevolutions) {
      const auto whole =
          RawAt(image, RegisterType::kInt16, decoding.order, decoding.revolutions[place]);
      if (!whole) return std::nullopt;
      q[j] += kOneTurn * decoding.revolutions_scale * *whole;
    }
  }
  return q;
}

std::vector<RegisterBlock> BlocksFor(const std::vector<std::pair<int, int>>& address_and_words,
                                     const RegisterImage& image, int max_count) {
  std::vector<std::pair<int, int>> wanted = address_and_words;
  std::sort(wanted.begin(), wanted.end());
  std::vector<RegisterBlock> blocks;
  for (const auto& [address, words] : wanted) {
    const int end = address + words;
    if (!blocks.empty()) {
      RegisterBlock& last = blocks.back();
      const int count = std::max(last.count, end - last.first);
      if (count <= max_count && image.Has(last.first, count)) {
        last.count = count;
        continue;
      }
    }
    blocks.push_back({image.table, address, words});
  }
  return blocks;
}

}  // namespace plumbline::robot
