#include "drivers/robot/decoding_search.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "drivers/robot/decoding_parts.h"

namespace plumbline::robot {
namespace {

constexpr double kChance = 1e-4;  // expected agreements by chance that still decide
constexpr std::size_t kMaxShown = 8;

bool AnyNegative(const DecodingCandidate& one, const kinematics::Chain& chain,
                 const DecodingEvidence& evidence) {
  return std::any_of(evidence.images.begin(), evidence.images.end(), [&](const auto& image) {
    const auto q = Decoded(one.joints, chain, image);
    return q && (q->array() < -kTinyJoint).any();
  });
}

bool SameValues(const DecodingCandidate& a, const DecodingCandidate& b,
                const kinematics::Chain& chain, const DecodingEvidence& evidence,
                double tolerance = kZeroJoint) {
  return std::all_of(evidence.images.begin(), evidence.images.end(), [&](const auto& image) {
    const auto qa = Decoded(a.joints, chain, image), qb = Decoded(b.joints, chain, image);
    return qa && qb && (*qa - *qb).cwiseAbs().maxCoeff() < tolerance;
  });
}

/// How credible a decoding is without any confirmation; the smallest first.
double Oddness(const DecodingCandidate& one) {
  const model::JointVector& q = one.q;
  const JointDecoding& joints = one.joints;
  const double zeros = (q.array().abs() < kZeroJoint).cast<double>().sum();
  const double largest = q.array().abs().maxCoeff();
  double odd = zeros;
  if (joints.addresses.size() > 1) {
    const int stride = joints.addresses[1] - joints.addresses[0];
    if (stride != WordsOf(joints.type)) odd += 2;
  }
  if (largest < 10 * kRadPerDeg) odd += 4;
  // Random words are hardly ever floats of a usual size.
  if (joints.type == RegisterType::kFloat32) odd -= 6;
  if (joints.type == RegisterType::kInt32) odd -= 3;
  if (joints.type == RegisterType::kUint16) odd += 1;
  return odd;
}

/// Registers of whole turns: as many as joints in a row, each a small number that brings its joint
/// within the limits, at least one not 0. Sets wrap and registers if exactly one such row brings
/// each joint within half a turn, or agrees with the pendant. @return number of such rows
std::size_t FindRevolutions(const kinematics::Chain& chain, const DecodingEvidence& evidence,
                            JointDecoding& joints) {
  const int n = chain.size();
  const std::set<int> strides = {1, n > 1 ? joints.addresses[1] - joints.addresses[0] : 1};
  const auto fits = [&](const JointDecoding& turned) {
    bool any = false;
    for (std::size_t k = 0; k < evidence.images.size(); ++k) {
      const auto part = Decoded(joints, chain, evidence.images[k]);
      const auto q = Decoded(turned, chain, evidence.images[k]);
      if (!q) return false;
      const auto shown = std::find_if(evidence.pendant.begin(), evidence.pendant.end(),
                                      [&](const PendantValues& one) { return one.image == k; });
      for (int j = 0; j < n; ++j) {
        const double expected = shown != evidence.pendant.end() ? shown->q[j] : 0;
        if (std::abs((*q)[j] - expected) > std::numbers::pi + kZeroJoint) return false;
        if ((*q)[j] < Lower(chain, j) || (*q)[j] > Upper(chain, j)) return false;
        any = any || std::abs((*q)[j] - (*part)[j]) > kOffZero;
      }
    }
    return any;
  };
  // Words of 0 and 1 may be flags; only the pendant tells them from turns that are counted down.
  const bool backwards = !evidence.pendant.empty();
  std::vector<JointDecoding> found;
  for (const auto& [first, word] : evidence.images.front().words) {
    for (const int step : strides) {
      for (const double scale : {1.0, -1.0}) {
        if (scale < 0 && !backwards) continue;
        JointDecoding turned = joints;
        turned.wrap = JointWrap::kRevolutions;
        turned.revolutions_scale = scale;
        for (int j = 0; j < n; ++j) turned.revolutions.push_back(first + j * step);
        if (fits(turned)) found.push_back(turned);
      }
    }
  }
  if (found.size() == 1) joints = found.front();
  return found.size();
}

/// Decides how a joint below zero is counted. @return what is open; empty if nothing
std::string ResolveWrap(const kinematics::Chain& chain, const DecodingEvidence& evidence,
                        DecodingCandidate& best) {
  if (AnyNegative(best, chain, evidence)) return "";
  bool shown_negative = false, beyond = false;
  for (const PendantValues& shown : evidence.pendant) {
    const auto q = Decoded(best.joints, chain, evidence.images[shown.image]);
    for (int j = 0; j < shown.q.size(); ++j) {
      shown_negative = shown_negative || (shown.q[j] < -kOffZero && (*q)[j] > kOffZero);
    }
  }
  double upper = 0, lower = 0;
  for (const RegisterImage& image : evidence.images) {
    const auto q = Decoded(best.joints, chain, image);
    for (int j = 0; j < q->size(); ++j) {
      if (chain.type(j) != model::JointType::kRevolute) continue;
      beyond = beyond || (*q)[j] > Upper(chain, j);
      upper = std::max(upper, Upper(chain, j));
      lower = std::min(lower, Lower(chain, j));
    }
  }
  const std::size_t rows = FindRevolutions(chain, evidence, best.joints);
  if (rows == 1 && best.joints.type == RegisterType::kInt16)
    best.joints.type = RegisterType::kUint16;  // a turn may have more counts than an int16
  if (rows == 1) return "";
  if (rows > 1) {
    return "the joints are counted modulo one turn, and several rows of registers may hold the "
           "whole "
           "turns: move other joints below zero, and scan again with --joints";
  }
  const bool one_turn = upper < std::numbers::pi + 0.1 && lower > -std::numbers::pi - 0.1;
  if (shown_negative || (beyond && one_turn)) {
    best.joints.wrap = JointWrap::kPi;
    if (best.joints.type == RegisterType::kInt16) best.joints.type = RegisterType::kUint16;
    return "";
  }
  return "no joint was below zero, so it is not known how a negative angle is counted (signed, or "
         "modulo one turn); move one joint to a clearly negative angle, such as -20 deg, and scan "
         "again with --joints";
}

/// With the candidates that are worth showing: of those that read most of the same registers in the
/// same way, the best one.
DecodingVerdict Undecided(DecodingVerdict verdict, std::string open) {
  verdict.state = DecodingVerdict::State::kUndecided;
  verdict.open = std::move(open);
  std::vector<DecodingCandidate> shown;
  for (DecodingCandidate& one : verdict.candidates) {
    const auto overlaps = [&](const DecodingCandidate& other) {
      if (other.joints.type != one.joints.type || other.joints.order != one.joints.order ||
          other.joints.unit != one.joints.unit) {
        return false;
      }
      const std::set<int> taken(other.joints.addresses.begin(), other.joints.addresses.end());
      const auto common = std::count_if(one.joints.addresses.begin(), one.joints.addresses.end(),
                                        [&](int address) { return taken.contains(address); });
      return 2 * common >= static_cast<std::ptrdiff_t>(one.joints.addresses.size());
    };
    if (shown.size() < kMaxShown && std::none_of(shown.begin(), shown.end(), overlaps))
      shown.push_back(std::move(one));
  }
  verdict.candidates = std::move(shown);
  return verdict;
}

}  // namespace

DecodingVerdict SearchDecoding(const kinematics::Chain& chain, const DecodingEvidence& evidence) {
  DecodingVerdict verdict;
  if (evidence.images.empty() || evidence.images.front().words.empty()) return verdict;
  std::vector<JointDecoding> decodings = PlausibleDecodings(chain, evidence.images);
  verdict.plausible = decodings.size();
  const bool all_moved = EveryAxisMoved(chain, evidence);
  if (all_moved &&
      std::none_of(decodings.begin(), decodings.end(), [&](const JointDecoding& decoding) {
        return MoveMisfit(decoding, chain, evidence).has_value();
      })) {
    const auto free = FreeDecodings(chain, evidence);
    decodings.insert(decodings.end(), free.begin(), free.end());
  }
  if (evidence.moving) {
    const auto still = [&](const JointDecoding& decoding) {
      return !Changes(decoding, chain, evidence.images);
    };
    decodings.erase(std::remove_if(decodings.begin(), decodings.end(), still), decodings.end());
  }
  std::vector<DecodingCandidate> left;
  for (const JointDecoding& decoding : decodings) {
    DecodingCandidate one;
    one.joints = decoding;
    if (!evidence.pendant.empty()) {
      if (PendantMisfit(decoding, chain, evidence) > 1) continue;
    }
    if (!evidence.moves.empty()) {
      const auto misfit = MoveMisfit(decoding, chain, evidence);
      if (!misfit) continue;
      one.unrest = *misfit;
    }
    one.q = *Decoded(decoding, chain, evidence.images.back());
    left.push_back(one);
  }
  std::vector<std::string> decided_by;
  if (!evidence.pendant.empty() &&
      PendantChance(chain, evidence) * static_cast<double>(verdict.plausible + 1) < kChance) {
    decided_by.emplace_back("the joints equal those of the teach pendant");
  }
  if (all_moved) decided_by.emplace_back("each axis moved alone, and its register alone followed");
  double expected = 1;
  const auto posed = WithPoses(left, chain, evidence, expected);
  if (!posed.empty() && expected < kChance) {
    left = posed;
    decided_by.emplace_back("forward kinematics of the joints equals a pose in the registers");
  }
  verdict.candidates = left;
  std::stable_sort(verdict.candidates.begin(), verdict.candidates.end(),
                   [&](const DecodingCandidate& a, const DecodingCandidate& b) {
                     return decided_by.empty() ? Oddness(a) < Oddness(b) : a.misfit < b.misfit;
                   });
  if (left.empty()) {
    const bool contradicted = !evidence.pendant.empty() || !evidence.moves.empty();
    const std::string reversed =
        evidence.moves.empty() ? "" : ReversedJoints(decodings, chain, evidence);
    if (!reversed.empty()) {
      verdict.open = reversed +
                     " counts the other way than stated: either it was moved the other way, or the "
                     "sign of that joint in the cell is not the controller's";
    } else if (contradicted && verdict.plausible > 0)
      verdict.open =
          "no decoding agrees with what was stated: check the stated values, and that "
          "the robot stood still";
    return verdict;
  }
  if (decided_by.empty()) {
    return Undecided(
        std::move(verdict),
        "plausible numbers are not yet joints: state what the teach pendant shows with "
        "--joints, or move one axis at a time with --confirm");
  }
  verdict.evidence = fmt::format("{}", fmt::join(decided_by, "; "));
  DecodingCandidate best = verdict.candidates.front();
  std::vector<DecodingCandidate> rivals;
  const bool negative = AnyNegative(best, chain, evidence);
  for (const DecodingCandidate& one : verdict.candidates) {
    if (one.misfit > kRivalRatio * best.misfit + kRivalFloor) continue;
    if (one.unrest > kRivalRatio * best.unrest + 1) continue;
    if (one.joints == best.joints) continue;
    if (SameValues(one, best, chain, evidence)) {
      // The low word alone, where the high word only continues the sign.
      const bool twins = one.joints.type != best.joints.type &&
                         std::abs(one.joints.addresses[0] - best.joints.addresses[0]) <= 1;
      if (twins && (negative || WordsOf(one.joints.type) == WordsOf(best.joints.type))) {
        if (WordsOf(one.joints.type) > WordsOf(best.joints.type)) best = one;
        continue;
      }
    }
    rivals.push_back(one);
  }
  // A twin of a decoding that is itself no longer the best is none of its rivals.
  rivals.erase(
      std::remove_if(rivals.begin(), rivals.end(),
                     [&](const DecodingCandidate& one) { return one.joints == best.joints; }),
      rivals.end());
  if (!rivals.empty()) {
    std::vector<DecodingCandidate> shown = {best};
    shown.insert(shown.end(), rivals.begin(), rivals.end());
    verdict.candidates = shown;
    constexpr double kSameJoints = 0.1 * kRadPerDeg;  // commanded and actual ones
    const bool apart = best.joints.addresses.back() < rivals.front().joints.addresses.front() ||
                       rivals.front().joints.addresses.back() < best.joints.addresses.front();
    const bool same = SameValues(best, rivals.front(), chain, evidence) ||
                      (apart && SameValues(best, rivals.front(), chain, evidence, kSameJoints));
    return Undecided(
        std::move(verdict),
        !same ? "several decodings agree with the evidence: scan again with --joints, with two "
                "decimals, "
                "in a posture whose joints all differ and are far from zero"
        : negative || apart
            ? "two places hold the same joints, perhaps the commanded and the actual ones: see the "
              "controller's manual"
            : "the same numbers can be read in two ways while no joint is below zero: move one "
              "joint to a clearly negative angle, such as -20 deg, and scan again with --joints");
  }
  const std::string open = ResolveWrap(chain, evidence, best);
  best.q = *Decoded(best.joints, chain, evidence.images.back());
  verdict.candidates = {best};
  if (!open.empty()) return Undecided(std::move(verdict), open);
  verdict.state = DecodingVerdict::State::kDecided;
  return verdict;
}

}  // namespace plumbline::robot
