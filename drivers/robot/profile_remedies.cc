#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "drivers/robot/codec.h"
#include "drivers/robot/decoding_parts.h"

namespace plumbline::robot {
namespace {

using modbus::WordOrder;

// Costs of a change, in bits: how much rarer it is than another word order.
constexpr double kOrder = 6, kShift = 9, kUnit = 9;
constexpr double kBitOfMantissa = 0.5;  // numbers of controllers are rounder than shifted words
constexpr double kMaxCost = 24;         // of the changes alone
constexpr double kMargin = 4;           // two changes that differ by less cannot be told apart

bool DecodedAlike(const JointSignal& a, const JointSignal& b) {
  return a.wrap == b.wrap && a.value.table == b.value.table && a.value.type == b.value.type &&
         a.value.order == b.value.order && a.value.scale == b.value.scale && a.value.offset == 0 &&
         b.value.offset == 0;
}

/// How much a decoding that gives plausible joints says by that, in bits, as a cost: random words
/// are hardly ever floats of a usual size, and the fractions of floats in shifted words are less
/// round. The roundest does not count: its last word may be an empty register behind the joints.
/// Integers say nothing: any word is one.
double PlausibilityCost(const JointDecoding& decoding, const RegisterImage& image) {
  constexpr double kPlausibleExponents = 24.0 / 256;
  constexpr int kMantissaBits = 23;
  if (decoding.type != RegisterType::kFloat32) return 0;
  double cost = 0;
  int zeros = 0, most = 0;
  for (const int address : decoding.addresses) {
    const double raw = RawAt(image, decoding.type, decoding.order, address).value_or(0);
    if (raw == 0) continue;
    const auto bits = std::bit_cast<std::uint32_t>(static_cast<float>(raw)) & 0x7FFFFFU;
    const int round = bits == 0 ? kMantissaBits : std::countr_zero(bits);
    cost += std::log2(kPlausibleExponents);
    zeros += round;
    most = std::max(most, round);
  }
  return cost - kBitOfMantissa * (zeros - most);
}

/// True if most joints of the profile that are not zero are plausible as they are. What is wrong
/// with the others is then no matter of the decoding, which all of them have in common.
bool MostArePlausible(const RobotProfile& profile, const kinematics::Chain& chain,
                      const RegisterImage& image) {
  int plausible = 0, others = 0;
  for (int j = 0; j < chain.size(); ++j) {
    const JointSignal& joint = profile.joints[static_cast<std::size_t>(j)];
    const auto raw = RawAt(image, joint.value.type, joint.value.order, joint.value.address);
    const double q = raw ? joint.value.scale * *raw : 0;
    if (q == 0) continue;
    ++(CanBe(chain, j, q, false) ? plausible : others);
  }
  return plausible > 0 && plausible >= others;
}

/// True if the registers of an integer profile are floats of plausible joints, at most one register
/// aside. Integers hardly ever look like that; floats with round values often are small integers.
bool LookLikeFloats(const RobotProfile& profile, const kinematics::Chain& chain,
                    const RegisterImage& image) {
  if (profile.joints.front().value.type == RegisterType::kFloat32) return false;
  for (const WordOrder order :
       {WordOrder::kAbcd, WordOrder::kCdab, WordOrder::kBadc, WordOrder::kDcba}) {
    for (const JointUnit& unit : JointUnits()) {
      for (int shift = -1; shift <= 1 && unit.real; ++shift) {
        JointDecoding floats{image.table, {}, RegisterType::kFloat32, order, &unit};
        for (const JointSignal& joint : profile.joints)
          floats.addresses.push_back(joint.value.address + shift);
        const auto q = Decoded(floats, chain, image);
        if (q && IsPlausible(chain, *q)) return true;
      }
    }
  }
  return false;
}

/// The profile's [tcp] in the image; nullopt if it has none, or the image lacks its registers.
std::optional<Pose> ReportedPose(const RobotProfile& profile, const RegisterImage& image) {
  const auto codec = RobotCodec::Create(profile);
  if (!codec || !profile.tcp) return std::nullopt;
  for (const auto* values : {&profile.tcp->position, &profile.tcp->orientation}) {
    for (const RegisterValue& value : *values) {
      if (value.table != image.table || !RawAt(image, value.type, value.order, value.address))
        return std::nullopt;
    }
  }
  std::vector<std::uint16_t> words;
  for (const RegisterBlock& block : codec->blocks()) {
    for (int address = block.first; address < block.first + block.count; ++address) {
      const auto word = image.words.find(address);
      words.push_back(word == image.words.end() ? std::uint16_t{0} : word->second);
    }
  }
  model::RobotState state;
  codec->RobotStateFromRegisters(words, state);
  if (!state.X_BT || !state.X_BT->p.allFinite() || !state.X_BT->R.allFinite()) return std::nullopt;
  return state.X_BT;
}

struct Change {
  double cost = 0;
  JointDecoding decoding{};
  int shift = 0;
  bool order = false, unit = false;
  model::JointVector q{};
  bool agrees = false;  ///< with the reported pose
  double misfit = 2;    ///< from it, in tolerances
};

std::string ChangeText(const Change& change, WordOrder before) {
  std::vector<std::string> parts;
  if (change.order) parts.push_back(fmt::format("word order {}", NameOf(change.decoding.order)));
  if (change.shift != 0) {
    parts.push_back(
        fmt::format("address {} {}", change.shift > 0 ? '+' : '-', std::abs(change.shift)));
  }
  if (change.unit) parts.push_back(fmt::format("unit {}", change.decoding.unit->text));
  const bool swapped =
      change.order && parts.size() == 1 &&
      (before == WordOrder::kAbcd || before == WordOrder::kCdab) &&
      (change.decoding.order == WordOrder::kAbcd || change.decoding.order == WordOrder::kCdab);
  return fmt::format("{}{} {} plausible joints", swapped ? "words are swapped: " : "",
                     fmt::join(parts, " and "), parts.size() == 1 ? "gives" : "give");
}

std::string KeysText(const Change& change) {
  std::vector<std::string> keys;
  if (change.order)
    keys.push_back(fmt::format("word_order = \"{}\"", NameOf(change.decoding.order)));
  if (change.shift != 0)
    keys.push_back(fmt::format("address = [{}]", fmt::join(change.decoding.addresses, ", ")));
  if (change.unit) {
    keys.push_back(fmt::format("unit = \"{}\", scale = {:g}", change.decoding.unit->unit,
                               change.decoding.unit->scale));
  }
  return fmt::format("{}", fmt::join(keys, ", "));
}

}  // namespace

std::vector<ProfileRemedy> RemediesOf(const RobotProfile& profile, const kinematics::Chain& chain,
                                      const RegisterImage& image, const std::vector<Pose>& tools) {
  const auto n = static_cast<std::size_t>(chain.size());
  if (profile.joints.size() != n ||
      !std::all_of(profile.joints.begin(), profile.joints.end(), [&](const JointSignal& joint) {
        return DecodedAlike(joint, profile.joints.front());
      })) {
    return {};
  }
  const JointSignal& declared = profile.joints.front();
  const RegisterType type = declared.value.type;
  const bool only_agreeing =
      MostArePlausible(profile, chain, image) || LookLikeFloats(profile, chain, image);
  const std::optional<Pose> reported = ReportedPose(profile, image);
  std::vector<Change> changes;
  double best_misfit = 2;
  for (const WordOrder order :
       {WordOrder::kAbcd, WordOrder::kCdab, WordOrder::kBadc, WordOrder::kDcba}) {
    if (WordsOf(type) == 1 && order != declared.value.order) continue;
    for (const JointUnit& unit : JointUnits()) {
      const bool real = type == RegisterType::kFloat32;
      if (unit.real != real || (WordsOf(type) == 1 && !unit.in16bits)) continue;
      for (int shift = -2; shift <= 2; ++shift) {
        Change change;
        change.shift = shift;
        change.order = order != declared.value.order;
        change.unit = std::abs(unit.rad / declared.value.scale - 1) > 1e-9 &&
                      !(chain.type(0) == model::JointType::kPrismatic &&
                        std::abs(unit.m / declared.value.scale - 1) < 1e-9);
        change.cost =
            (change.order ? kOrder : 0) + kShift * std::abs(shift) + (change.unit ? kUnit : 0);
        if (change.cost == 0 || change.cost > kMaxCost) continue;
        change.decoding = {image.table, {}, type, order, &unit, declared.wrap};
        for (const JointSignal& joint : profile.joints) {
          change.decoding.addresses.push_back(joint.value.address + shift);
          if (declared.wrap != JointWrap::kRevolutions) continue;
          change.decoding.revolutions.push_back(joint.revolutions.address);
          change.decoding.revolutions_scale = joint.revolutions.scale;
        }
        const auto q = Decoded(change.decoding, chain, image);
        if (!q || !IsPlausible(chain, *q)) continue;
        change.q = *q;
        change.cost += PlausibilityCost(change.decoding, image);
        kinematics::Posture posture;
        chain.Evaluate(*q, posture);
        std::vector<Pose> tips = {Pose()};
        if (!profile.tcp_is_flange) tips.insert(tips.end(), tools.begin(), tools.end());
        for (const Pose& X_FT : tips) {
          if (!reported) break;
          const Pose X_BT = posture.X_BF() * X_FT;
          const double distance = (X_BT.p - reported->p).norm() / kLimits.tcp_tolerance_m;
          const double angle = VectorFromRotation(X_BT.R * reported->R.transpose()).norm() /
                               kLimits.tcp_tolerance_rad;
          if (distance > 1 || angle > 1) continue;
          change.agrees = true;
          change.misfit = std::min(change.misfit, std::hypot(distance, angle));
          best_misfit = std::min(best_misfit, change.misfit);
        }
        if (change.agrees || !only_agreeing) changes.push_back(change);
      }
    }
  }
  for (Change& change : changes) {
    change.agrees = change.agrees && change.misfit <= kRivalRatio * best_misfit + kRivalFloor;
  }
  std::stable_sort(changes.begin(), changes.end(), [](const Change& a, const Change& b) {
    return a.agrees != b.agrees ? a.agrees : a.cost < b.cost;
  });
  std::vector<ProfileRemedy> remedies;
  for (const Change& change : changes) {
    if (change.agrees != changes.front().agrees || change.cost > changes.front().cost + kMargin ||
        remedies.size() == 3) {
      break;
    }
    remedies.push_back({fmt::format("{} ({}){}", ChangeText(change, declared.value.order),
                                    JointsText(chain, change.q),
                                    change.agrees ? ", and they agree with the tool pose" : ""),
                        KeysText(change), change.agrees});
  }
  return remedies;
}

}  // namespace plumbline::robot
