#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "drivers/robot/decoding_parts.h"

namespace plumbline::robot {
namespace {

constexpr double kStill = 0.4;  // change of a joint that was not moved [deg] or [mm]
constexpr double kStillTolerance = 0.05;
constexpr double kMoveShare = 0.25;  // of the stated amount; units differ by 1.7 at least
constexpr std::size_t kMaxFree = 64;

}  // namespace

double PendantMisfit(const JointDecoding& decoding, const kinematics::Chain& chain,
                     const DecodingEvidence& evidence, bool whole_turns) {
  double worst = 0;
  for (const PendantValues& shown : evidence.pendant) {
    const auto q = Decoded(decoding, chain, evidence.images[shown.image]);
    if (!q || q->size() != shown.q.size()) return std::numeric_limits<double>::infinity();
    for (int j = 0; j < q->size(); ++j) {
      const double tolerance =
          shown.tolerance * PendantUnit(chain, j) + 0.6 * StepOf(decoding, chain, j);
      const double difference =
          whole_turns ? (*q)[j] - shown.q[j] : Difference(chain, j, (*q)[j], shown.q[j]);
      worst = std::max(worst, std::abs(difference) / tolerance);
    }
  }
  return worst;
}

double PendantChance(const kinematics::Chain& chain, const DecodingEvidence& evidence) {
  double chance = 1;
  for (const PendantValues& shown : evidence.pendant) {
    std::set<double> seen;
    for (int j = 0; j < shown.q.size(); ++j) {
      const double unit = PendantUnit(chain, j);
      if (std::abs(shown.q[j]) < kOffZero * unit || !seen.insert(std::abs(shown.q[j])).second)
        continue;
      chance *= std::min(1.0, 2 * shown.tolerance * unit / (Upper(chain, j) - Lower(chain, j)));
    }
  }
  return chance;
}

namespace {

struct MoveFit {
  bool fits = false;
  double still_rms = 0;  ///< change of the joints that were not moved [deg] or [mm]
};

MoveFit FitOfJoint(const std::vector<double>& values, const DecodingEvidence& evidence, int joint,
                   const kinematics::Chain& chain, double step) {
  MoveFit fit;
  int count = 0;
  const double unit = PendantUnit(chain, joint);
  for (const AxisMove& move : evidence.moves) {
    const double change = Difference(chain, joint, values[move.before + 1], values[move.before]);
    if (move.joint == joint) {
      if (std::abs(change - move.by) > kMoveShare * std::abs(move.by) + 2 * step) return fit;
    } else {
      if (std::abs(change) > kStill * unit + 2 * step) return fit;
      const double beyond = std::max(0.0, std::abs(change) - 1.1 * step) / unit;
      fit.still_rms += beyond * beyond;
      ++count;
    }
  }
  fit.still_rms = count > 0 ? std::sqrt(fit.still_rms / count) : 0;
  fit.fits = true;
  return fit;
}

MoveFit FitOfMoves(const JointDecoding& decoding, const kinematics::Chain& chain,
                   const DecodingEvidence& evidence) {
  MoveFit all{true, 0};
  std::vector<std::vector<double>> values(static_cast<std::size_t>(chain.size()));
  for (const RegisterImage& image : evidence.images) {
    const auto q = Decoded(decoding, chain, image);
    if (!q) return {};
    for (int j = 0; j < q->size(); ++j) values[static_cast<std::size_t>(j)].push_back((*q)[j]);
  }
  for (int j = 0; j < chain.size() && all.fits; ++j) {
    const MoveFit one = FitOfJoint(values[static_cast<std::size_t>(j)], evidence, j, chain,
                                   StepOf(decoding, chain, j));
    all.fits = one.fits;
    all.still_rms = std::max(all.still_rms, one.still_rms);
  }
  return all;
}

}  // namespace

std::optional<double> MoveMisfit(const JointDecoding& decoding, const kinematics::Chain& chain,
                                 const DecodingEvidence& evidence) {
  const MoveFit fit = FitOfMoves(decoding, chain, evidence);
  if (!fit.fits) return std::nullopt;
  return fit.still_rms / kStillTolerance;
}

bool EveryAxisMoved(const kinematics::Chain& chain, const DecodingEvidence& evidence) {
  std::set<int> moved;
  for (const AxisMove& move : evidence.moves) moved.insert(move.joint);
  return static_cast<int>(moved.size()) == chain.size();
}

std::string ReversedJoints(const std::vector<JointDecoding>& decodings,
                           const kinematics::Chain& chain, const DecodingEvidence& evidence) {
  for (const JointDecoding& decoding : decodings) {
    DecodingEvidence turned = evidence;
    const auto q = [&](std::size_t image) {
      return Decoded(decoding, chain, evidence.images[image]);
    };
    std::set<int> reversed;
    for (AxisMove& move : turned.moves) {
      const auto before = q(move.before), after = q(move.before + 1);
      if (!before || !after) continue;
      if (Difference(chain, move.joint, (*after)[move.joint], (*before)[move.joint]) * move.by <
          0) {
        move.by = -move.by;
        reversed.insert(move.joint + 1);
      }
    }
    if (FitOfMoves(decoding, chain, turned).fits)
      return fmt::format("joint {} of \"{}\"", fmt::join(reversed, ", "), TextOf(decoding));
  }
  return "";
}

std::vector<JointDecoding> FreeDecodings(const kinematics::Chain& chain,
                                         const DecodingEvidence& evidence,
                                         const SearchBounds& bounds) {
  std::vector<JointDecoding> found;
  const RegisterImage& image = evidence.images.front();
  for (const Encoding& encoding : Encodings()) {
    std::vector<RawValues> raw;
    for (const RegisterImage& one : evidence.images) raw.emplace_back(one, encoding);
    for (const JointUnit& unit : JointUnits()) {
      if (!Uses(encoding, unit)) continue;
      if (bounds.stop && bounds.stop()) return {};
      std::vector<std::vector<int>> places(static_cast<std::size_t>(chain.size()));
      for (const auto& [address, word] : image.words) {
        for (int j = 0; j < chain.size(); ++j) {
          const bool turns = chain.type(j) == model::JointType::kRevolute;
          const double si = turns ? unit.rad : unit.m;
          std::vector<double> values;
          for (const RawValues& one : raw) values.push_back(one[address] * si);
          const bool can_be = std::all_of(values.begin(), values.end(), [&](double q) {
            return CanBe(chain, j, q, encoding.type == RegisterType::kUint16);
          });
          const double step = encoding.type == RegisterType::kFloat32 ? 0 : si;
          if (can_be && FitOfJoint(values, evidence, j, chain, step).fits)
            places[static_cast<std::size_t>(j)].push_back(address);
        }
      }
      std::vector<JointDecoding> all = {{image.table, {}, encoding.type, encoding.order, &unit}};
      for (const std::vector<int>& of_joint : places) {
        std::vector<JointDecoding> longer;
        for (const JointDecoding& one : all) {
          for (const int address : of_joint) {
            if (longer.size() >= kMaxFree) break;
            longer.push_back(one);
            longer.back().addresses.push_back(address);
          }
        }
        all = longer;
      }
      found.insert(found.end(), all.begin(), all.end());
    }
  }
  return found;
}

}  // namespace plumbline::robot
