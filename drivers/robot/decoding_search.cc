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

constexpr double kNear = 2;         // [deg] or [mm] between commanded and actual joints
constexpr double kExactly = 1e-7;   // [deg] or [mm]
constexpr double kSmallest = 1e-6;  // of joints that are not zero; smaller ones are rare

bool Turns(const kinematics::Chain& chain, int joint) {
  return chain.type(joint) == model::JointType::kRevolute;
}

/// @param turning  only joints that turn count
bool AnyNegative(const DecodingCandidate& one, const kinematics::Chain& chain,
                 const DecodingEvidence& evidence, bool turning) {
  return std::any_of(evidence.images.begin(), evidence.images.end(), [&](const auto& image) {
    const auto q = Decoded(one.joints, chain, image);
    for (int j = 0; q && j < q->size(); ++j) {
      if ((*q)[j] < -kSmallest && (Turns(chain, j) || !turning)) return true;
    }
    return false;
  });
}

/// @param tolerance  [deg] or [mm]
bool SameValues(const DecodingCandidate& a, const DecodingCandidate& b,
                const kinematics::Chain& chain, const DecodingEvidence& evidence,
                double tolerance) {
  return std::all_of(evidence.images.begin(), evidence.images.end(), [&](const auto& image) {
    const auto qa = Decoded(a.joints, chain, image), qb = Decoded(b.joints, chain, image);
    for (int j = 0; qa && qb && j < qa->size(); ++j) {
      if (std::abs((*qa)[j] - (*qb)[j]) > tolerance * PendantUnit(chain, j)) return false;
    }
    return qa && qb;
  });
}

bool ShareRegisters(const JointDecoding& a, const JointDecoding& b) {
  return std::any_of(a.addresses.begin(), a.addresses.end(), [&](int one) {
    return std::any_of(b.addresses.begin(), b.addresses.end(), [&](int other) {
      return one < other + WordsOf(b.type) && other < one + WordsOf(a.type);
    });
  });
}

/// Two readings of the same registers, one register apart: "41 48 00 00 41 48 .." is 12.5 as ABCD
/// from the first register on, and as CDAB from the one before it, as long as the values are round.
bool AreShifted(const DecodingCandidate& a, const DecodingCandidate& b,
                const kinematics::Chain& chain, const DecodingEvidence& evidence) {
  return a.joints.type == b.joints.type && ShareRegisters(a.joints, b.joints) &&
         SameValues(a, b, chain, evidence, kNear);
}

/// True if a joint changed, and with each joint that did all of its registers: a low word that
/// stays as it is belongs to another number, or the values are round.
bool AllWordsFollow(const DecodingCandidate& one, const kinematics::Chain& chain,
                    const DecodingEvidence& evidence) {
  const JointDecoding& joints = one.joints;
  const RegisterImage& first = evidence.images.front();
  const auto changes = [&](int address) {
    return std::any_of(evidence.images.begin(), evidence.images.end(), [&](const auto& image) {
      return image.words.at(address) != first.words.at(address);
    });
  };
  const auto before = Decoded(joints, chain, first);
  bool any = false;
  for (std::size_t j = 0; before && j < joints.addresses.size(); ++j) {
    const auto joint = static_cast<int>(j);
    const bool moved =
        std::any_of(evidence.images.begin(), evidence.images.end(), [&](const auto& image) {
          const auto q = Decoded(joints, chain, image);
          return q &&
                 std::abs((*q)[joint] - (*before)[joint]) > kOffZero * PendantUnit(chain, joint);
        });
    if (!moved) continue;
    any = true;
    for (int k = 0; k < WordsOf(joints.type); ++k) {
      if (!changes(joints.addresses[j] + k)) return false;
    }
  }
  return any;
}

/// The candidates with a pose, and behind them the others that it leaves in question. A pose shows
/// how the registers of its joints are decoded, but other registers may hold the joints as well:
/// those of the actual joints beside a stored point that the robot has reached, or the commanded
/// ones. Once joints and pose have moved together, only others that were near all the time are
/// left.
std::vector<DecodingCandidate> NarrowedBy(std::vector<DecodingCandidate> posed,
                                          const std::vector<DecodingCandidate>& all, bool moved,
                                          const kinematics::Chain& chain,
                                          const DecodingEvidence& evidence) {
  const std::size_t count = posed.size();
  const auto best = *std::min_element(
      posed.begin(), posed.end(), [](const auto& a, const auto& b) { return a.misfit < b.misfit; });
  for (const DecodingCandidate& one : all) {
    const bool beside =
        std::none_of(posed.begin(), posed.begin() + static_cast<std::ptrdiff_t>(count),
                     [&](const auto& other) { return ShareRegisters(one.joints, other.joints); });
    if (!beside || (moved && !SameValues(one, best, chain, evidence, kNear))) continue;
    posed.push_back(one);
  }
  return posed;
}

/// How credible a decoding is without any confirmation; the smallest first.
double Oddness(const DecodingCandidate& one) {
  const model::JointVector& q = one.q;
  const JointDecoding& joints = one.joints;
  const double zeros = (q.array().abs() < kSmallest).cast<double>().sum();
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

/// Words beside a row of whole turns that could as well be whole turns of another joint, such as
/// flags.
std::ptrdiff_t SmallNumbersBeside(const RegisterImage& image, const std::vector<int>& row) {
  constexpr int kBeside = 16, kFew = 3;
  const std::set<int> own(row.begin(), row.end());
  return std::count_if(image.words.lower_bound(*own.begin() - kBeside),
                       image.words.upper_bound(*own.rbegin() + kBeside), [&](const auto& word) {
                         const auto number = static_cast<std::int16_t>(word.second);
                         return !own.contains(word.first) && number != 0 &&
                                std::abs(number) <= kFew;
                       });
}

/// Registers of whole turns: as many as joints in a row, each a small number that makes its joint
/// equal to the pendant in each image, not 0 for two joints at least. Sets wrap and registers if
/// exactly one such row does, and its neighbours are no such numbers. @return number of such rows
std::size_t FindRevolutions(const kinematics::Chain& chain, const DecodingEvidence& evidence,
                            JointDecoding& joints) {
  const int n = chain.size();
  const std::set<int> strides = {1, n > 1 ? joints.addresses[1] - joints.addresses[0] : 1};
  const auto fits = [&](const JointDecoding& turned) {
    if (PendantMisfit(turned, chain, evidence, true) > 1) return false;
    for (const RegisterImage& image : evidence.images) {
      const auto part = Decoded(joints, chain, image);
      const auto q = Decoded(turned, chain, image);
      if (!q) return false;
      int turning = 0;
      for (int j = 0; j < n; ++j) {
        if ((*q)[j] < Lower(chain, j) || (*q)[j] > Upper(chain, j)) return false;
        turning += std::abs((*q)[j] - (*part)[j]) > std::numbers::pi ? 1 : 0;
      }
      if (turning < std::min(n, 2)) return false;
    }
    return true;
  };
  std::vector<JointDecoding> found;
  std::size_t rows = 0;
  for (const auto& [first, word] : evidence.images.front().words) {
    for (const int step : strides) {
      for (const double scale : {1.0, -1.0}) {
        JointDecoding turned = joints;
        turned.wrap = JointWrap::kRevolutions;
        turned.revolutions_scale = scale;
        for (int j = 0; j < n; ++j) turned.revolutions.push_back(first + j * step);
        if (!fits(turned)) continue;
        rows += SmallNumbersBeside(evidence.images.front(), turned.revolutions) > 2 ? 2 : 1;
        found.push_back(turned);
      }
    }
  }
  if (rows == 1) joints = found.front();
  return rows;
}

/// Decides how a joint below zero, or beyond half a turn, is counted. @return what is open; empty
/// if nothing
std::string ResolveWrap(const kinematics::Chain& chain, const DecodingEvidence& evidence,
                        DecodingCandidate& best) {
  const bool equal = PendantMisfit(best.joints, chain, evidence, true) <= 1;
  const bool negative = AnyNegative(best, chain, evidence, true);
  bool beyond = false, can_be_negative = false, one_turn = true;
  for (int j = 0; j < chain.size(); ++j) {
    if (!Turns(chain, j)) continue;
    can_be_negative = can_be_negative || Lower(chain, j) < -kOffZero * kRadPerDeg;
    one_turn = one_turn && std::max(Upper(chain, j), -Lower(chain, j)) < std::numbers::pi + 0.1;
    beyond =
        beyond || std::any_of(evidence.images.begin(), evidence.images.end(), [&](const auto& i) {
          return (*Decoded(best.joints, chain, i))[j] > Upper(chain, j);
        });
  }
  if (equal && !beyond && (negative || !can_be_negative)) return "";
  const auto as_unsigned = [&] {  // a turn may have more counts than an int16
    if (!negative && best.joints.type == RegisterType::kInt16)
      best.joints.type = RegisterType::kUint16;
  };
  if (!negative && one_turn && (!equal || beyond)) {  // whole turns are of no use
    JointDecoding half = best.joints;
    half.wrap = JointWrap::kPi;
    if (PendantMisfit(half, chain, evidence, true) <= 1) {
      best.joints = half;
      as_unsigned();
      return "";
    }
  }
  if (!equal) {
    const std::size_t rows = FindRevolutions(chain, evidence, best.joints);
    if (rows == 1) {
      as_unsigned();
      return "";
    }
    if (rows > 1) {
      return "the joints are counted modulo one turn, and several rows of registers may hold the "
             "whole turns: move other joints below zero, and scan again with --joints";
    }
  }
  if (!equal || beyond) {
    return "the joints are counted modulo one turn, the arm turns further, and no row of registers "
           "with the whole turns was found: move two joints below zero and scan again with "
           "--joints, or find the whole turns in the controller's manual and write the profile";
  }
  return "no joint was below zero, so it is not known how a negative angle is counted (signed, or "
         "modulo one turn); move one joint to a clearly negative angle, such as -20 deg, and scan "
         "again with --joints";
}

/// True if the arm turns beyond half a turn, but no joint did.
bool BeyondIsUnseen(const kinematics::Chain& chain, const DecodingEvidence& evidence,
                    const JointDecoding& joints) {
  if (joints.wrap != JointWrap::kNone) return false;
  bool can = false, did = false;
  for (int j = 0; j < chain.size(); ++j) {
    if (!Turns(chain, j)) continue;
    can = can || std::max(Upper(chain, j), -Lower(chain, j)) > std::numbers::pi + 0.1;
    for (const RegisterImage& image : evidence.images)
      did = did || std::abs((*Decoded(joints, chain, image))[j]) > std::numbers::pi;
  }
  return can && !did;
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

/// What is open about joints that differ from their pose while both move; empty if nothing.
std::string LeadText(const DecodingCandidate& best) {
  if (!best.lead_s) {
    return fmt::format(
        "forward kinematics of the joints is up to {:.2g} mm from the pose, more than their "
        "registers are coarse, and the motion does not show whether the joints lead or lag the "
        "pose: let the robot stop and turn back, and follow it with --watch 20",
        kMmPerMetre * best.distance_m);
  }
  if (*best.lead_s == 0) return "";
  return fmt::format(
      "these joints {} the pose by {:.2f} s (up to {:.2g} mm), so one of the two is commanded and "
      "not attained: find the registers of the actual joints and of the actual pose in the "
      "controller's manual, and scan with --range",
      *best.lead_s > 0 ? "lead" : "lag", std::abs(*best.lead_s), kMmPerMetre * best.distance_m);
}

}  // namespace

DecodingVerdict SearchDecoding(const kinematics::Chain& chain, const DecodingEvidence& evidence,
                               const SearchBounds& bounds) {
  DecodingVerdict verdict;
  if (evidence.images.empty() || evidence.images.front().words.empty()) return verdict;
  const auto too_many = [&](DecodingVerdict so_far) {
    return Undecided(
        std::move(so_far),
        fmt::format("too many registers ({}) hold numbers that could be joints: limit "
                    "the scan with --range to those that the controller's manual names",
                    evidence.images.front().words.size()));
  };
  if (evidence.images.front().words.size() > bounds.max_words) return too_many(std::move(verdict));
  PlausibleDecodings found = FindPlausible(chain, evidence, bounds);
  std::vector<JointDecoding>& decodings = found.agreeing;
  verdict.plausible = found.plausible;
  const bool all_moved = EveryAxisMoved(chain, evidence);
  if (all_moved &&
      std::none_of(decodings.begin(), decodings.end(), [&](const JointDecoding& decoding) {
        return MoveMisfit(decoding, chain, evidence).has_value();
      })) {
    const auto free = FreeDecodings(chain, evidence, bounds);
    decodings.insert(decodings.end(), free.begin(), free.end());
  }
  std::vector<DecodingCandidate> left;
  for (const JointDecoding& decoding : decodings) {
    DecodingCandidate one;
    one.joints = decoding;
    if (PendantMisfit(decoding, chain, evidence, false) > 1) continue;
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
  const auto posed = WithPoses(left, chain, evidence, bounds, expected);
  const bool agrees = !posed.empty() && expected < kChance;
  const bool moved =
      agrees && std::any_of(posed.begin(), posed.end(), [](const auto& one) { return one.moved; });
  if (moved) {
    decided_by.emplace_back(
        "forward kinematics of the joints equals a pose in the registers, and both moved");
  } else if (agrees && !decided_by.empty()) {
    decided_by.emplace_back("forward kinematics of the joints equals a pose in the registers");
  }
  if (agrees) left = NarrowedBy(posed, left, moved, chain, evidence);
  verdict.candidates = left;
  std::stable_sort(verdict.candidates.begin(), verdict.candidates.end(),
                   [&](const DecodingCandidate& a, const DecodingCandidate& b) {
                     if (a.with_pose != b.with_pose) return a.with_pose;
                     return decided_by.empty() ? Oddness(a) < Oddness(b) : a.misfit < b.misfit;
                   });
  if ((bounds.stop && bounds.stop()) || (!found.complete && !decided_by.empty()))
    return too_many(std::move(verdict));
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
  if (decided_by.empty() && agrees) {
    return Undecided(
        std::move(verdict),
        "a pose in the registers equals the forward kinematics of joints beside it, but nothing "
        "moved, so both may be a stored point: state what the teach pendant shows with --joints, "
        "let the robot work and follow it with --watch 20, or move one axis at a time with "
        "--confirm");
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
  const bool negative = AnyNegative(best, chain, evidence, false);
  for (const DecodingCandidate& one : verdict.candidates) {
    if (one.misfit > kRivalRatio * best.misfit + kRivalFloor) continue;
    if (one.unrest > kRivalRatio * best.unrest + 1) continue;
    if (one.joints == best.joints) continue;
    if (SameValues(one, best, chain, evidence, kExactly)) {
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
  const bool whole = AllWordsFollow(best, chain, evidence);
  const DecodingCandidate least = best;
  for (const DecodingCandidate& one : rivals) {
    if (whole || !AreShifted(one, least, chain, evidence)) continue;
    if (one.misfit <= least.misfit && one.unrest <= least.unrest &&
        AllWordsFollow(one, chain, evidence))
      best = one;
  }
  if (AllWordsFollow(best, chain, evidence)) {
    std::erase_if(rivals, [&](const DecodingCandidate& one) {
      return AreShifted(one, best, chain, evidence) && best.misfit <= one.misfit &&
             best.unrest <= one.unrest && !AllWordsFollow(one, chain, evidence);
    });
  }
  // A twin of a decoding that is itself no longer the best is none of its rivals.
  rivals.erase(
      std::remove_if(rivals.begin(), rivals.end(),
                     [&](const DecodingCandidate& one) { return one.joints == best.joints; }),
      rivals.end());
  if (!rivals.empty()) {
    // Another place is the harder question: it comes first.
    std::stable_partition(rivals.begin(), rivals.end(), [&](const DecodingCandidate& one) {
      return !ShareRegisters(one.joints, best.joints);
    });
    std::vector<DecodingCandidate> shown = {best};
    shown.insert(shown.end(), rivals.begin(), rivals.end());
    verdict.candidates = shown;
    const bool beside = !ShareRegisters(best.joints, rivals.front().joints);
    const bool same = SameValues(best, rivals.front(), chain, evidence, beside ? kNear : kExactly);
    const bool can_be_negative = (chain.lower().array() < 0).any();
    if (AreShifted(best, rivals.front(), chain, evidence)) {
      return Undecided(
          std::move(verdict),
          fmt::format("\"{}\" and \"{}\" read the same registers, and differ only where the "
                      "values are not round: move the robot to values that are not round (such as "
                      "12.34 deg), and scan again",
                      TextOf(best.joints), TextOf(rivals.front().joints)));
    }
    return Undecided(
        std::move(verdict),
        !same ? "several decodings agree with the evidence: scan again with --joints, with two "
                "decimals, in a posture whose joints all differ and are far from zero"
        : negative || beside
            ? "two places hold the same joints, perhaps the commanded and the actual ones: see the "
              "controller's manual"
        : can_be_negative
            ? "the same numbers can be read in two ways while no joint is below zero: move one "
              "joint to a clearly negative angle, such as -20 deg, and scan again with --joints"
            : "the same numbers can be read as 16 or as 32 bits while they are small: move every "
              "joint further from zero, and scan again with --joints");
  }
  std::string open = LeadText(best);
  if (open.empty()) open = ResolveWrap(chain, evidence, best);
  best.q = *Decoded(best.joints, chain, evidence.images.back());
  verdict.candidates = {best};
  if (!open.empty()) return Undecided(std::move(verdict), open);
  if (BeyondIsUnseen(chain, evidence, best.joints)) {
    verdict.evidence +=
        "; no joint was beyond half a turn, so compare it with the teach pendant "
        "when one is";
  }
  verdict.state = DecodingVerdict::State::kDecided;
  return verdict;
}

}  // namespace plumbline::robot
