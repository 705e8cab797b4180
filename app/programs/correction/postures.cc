#include "app/programs/correction/postures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "firmware-like/correction/point_posture.h"

namespace plumbline::programs {
namespace {

using model::JointVector;

constexpr double kTurn = 2 * std::numbers::pi;
constexpr double kSameJoint = 1e-5;  // [rad] or [m]
constexpr int kIterations = 40;

/// Largest joint difference, whole turns of revolute joints disregarded.
double DifferenceWithoutTurns(const kinematics::Chain& chain, const JointVector& a,
                              const JointVector& b) {
  double largest = 0;
  for (int i = 0; i < chain.size(); ++i) {
    double difference = a[i] - b[i];
    if (chain.RepeatsAfterTurn(i)) difference -= kTurn * std::round(difference / kTurn);
    largest = std::max(largest, std::abs(difference));
  }
  return largest;
}

void AddBranch(const kinematics::Chain& chain, const JointVector& q,
               std::vector<JointVector>& found) {
  const bool known = std::ranges::any_of(found, [&](const JointVector& other) {
    return DifferenceWithoutTurns(chain, q, other) < kSameJoint;
  });
  if (!known) found.push_back(q);
}

/// Adds to each posture those with one joint turned by whole turns within its limits.
void AddTurns(const kinematics::Chain& chain, int joint, std::vector<JointVector>& postures) {
  constexpr std::size_t kMost = 4096;
  if (!chain.RepeatsAfterTurn(joint)) return;
  const auto finite = [](double limit, double otherwise) {
    return std::isfinite(limit) ? limit : otherwise;
  };
  const double low = finite(chain.lower()[joint], -kTurn),
               high = finite(chain.upper()[joint], kTurn);
  const std::size_t before = postures.size();
  for (std::size_t k = 0; k < before && postures.size() < kMost; ++k) {
    const JointVector base = postures[k];
    const double first = base[joint] - kTurn * std::floor((base[joint] - low) / kTurn);
    for (double q = first; q <= high && postures.size() < kMost; q += kTurn) {
      if (std::abs(q - base[joint]) < kSameJoint) continue;
      JointVector turned = base;
      // The axes that turn with it make whole turns, too, and stay where they are.
      if (chain.couplings().empty()) {
        turned[joint] = q;
      } else {
        turned += chain.ReportedFromAxes<double>((q - base[joint]) *
                                                 JointVector::Unit(chain.size(), joint));
      }
      if (chain.WithinLimits(turned)) postures.push_back(turned);
    }
  }
}

kinematics::InverseOutcome Solve(const correction::Corrector& corrector, const ArmTarget& target,
                                 JointVector& q) {
  const deflection::LoadedArm& arm = corrector.arm();
  const Pose& X_FT = arm.X_FT(target.tool);
  const auto tip = [&](const JointVector& theta, kinematics::Posture& posture) {
    arm.chain().Evaluate(theta, posture);
    const Pose X_BT = posture.X_BF() * X_FT;
    return Pose{X_BT.R, X_BT * target.p_TP};
  };
  return kinematics::SolvePose(arm.chain(), {target.X_BP, corrector.orientation()}, tip,
                               kIterations, q);
}

/// One posture of each branch, as near to zero as whole turns allow.
std::vector<JointVector> BranchesOf(const correction::Corrector& corrector,
                                    const ArmTarget& target) {
  constexpr int kSpread = 24, kMirrored = 8;
  const kinematics::Chain& chain = corrector.arm().chain();
  const JointVector zero = JointVector::Zero(chain.size());
  std::vector<JointVector> found;
  double least_rad = std::numeric_limits<double>::infinity();
  const auto add = [&](JointVector q) {
    const kinematics::InverseOutcome outcome = Solve(corrector, target, q);
    if (!outcome.converged) return;
    // An arm that cannot take every orientation: those that come as near as any.
    constexpr double kSameResidual_rad = 1e-6;
    if (corrector.orientation() == kinematics::Orientation::kNearest) {
      if (outcome.residual_rad > least_rad + kSameResidual_rad) return;
      if (outcome.residual_rad < least_rad - kSameResidual_rad) found.clear();
      least_rad = std::min(least_rad, outcome.residual_rad);
    }
    static_cast<void>(kinematics::WrapIntoLimits(chain, zero, q));
    AddBranch(chain, q, found);
  };
  for (int k = 0; k < kSpread; ++k) add(kinematics::RestartPosture(chain, zero, kMirrored + k));
  constexpr std::size_t kMostBranches = 32;
  for (std::size_t k = 0; k < found.size() && k < kMostBranches; ++k) {
    const JointVector from = found[k];
    for (int index = 1; index < kMirrored; ++index) {
      add(kinematics::RestartPosture(chain, from, index));
    }
  }
  return found;
}

/// Branches at one target from those at another; empty unless each leads to one of its own.
std::vector<JointVector> BranchesFrom(const correction::Corrector& corrector,
                                      const ArmTarget& target,
                                      const std::vector<JointVector>& others) {
  const kinematics::Chain& chain = corrector.arm().chain();
  const JointVector zero = JointVector::Zero(chain.size());
  std::vector<JointVector> found;
  for (const JointVector& other : others) {
    JointVector q = other;
    if (!Solve(corrector, target, q).converged) return {};
    static_cast<void>(kinematics::WrapIntoLimits(chain, zero, q));
    AddBranch(chain, q, found);
  }
  return found.size() == others.size() ? found : std::vector<JointVector>();
}

std::vector<JointVector> WithTurns(const kinematics::Chain& chain,
                                   std::vector<JointVector> branches) {
  for (int joint = 0; joint < chain.size(); ++joint) AddTurns(chain, joint, branches);
  std::erase_if(branches, [&](const JointVector& q) { return !chain.WithinLimits(q); });
  return branches;
}

/// The posture at the end of a path, followed in steps in which no joint turns far; nullopt where
/// it leaves the limits or passes a singularity.
std::optional<JointVector> Followed(const correction::Corrector& corrector,
                                    const std::function<ArmTarget(double)>& along,
                                    const JointVector& start) {
  constexpr double kFar = 0.35;  // [rad] or [m]
  constexpr double kLeastStep = 1.0 / 1024;
  JointVector q = start;
  double share = 0;
  for (double step = 1; share < 1;) {
    const double to = std::min(1.0, share + step);
    const auto next = PostureNear(corrector, along(to), q);
    if (next && (*next - q).cwiseAbs().maxCoeff() < kFar) {
      q = *next;
      share = to;
      step *= 2;
    } else if ((step /= 2) < kLeastStep) {
      return std::nullopt;
    }
  }
  return q;
}

/// The one of all postures that reach a target that a motion takes.
Result<JointVector> OneOf(const kinematics::Chain& chain, const PostureQuestion& question,
                          std::vector<JointVector> postures) {
  const std::optional<JointVector>& seed = question.seed;
  if (postures.empty()) {
    return Error{"no posture within the joint limits reaches it; check base, tool and limits"};
  }
  const std::string no_seed = question.no_seed.empty() ? "" : " (" + question.no_seed + ")";
  const std::size_t all = postures.size();
  if (question.agrees) {
    std::erase_if(postures, [&](const JointVector& q) { return !question.agrees(q); });
  }
  if (postures.empty()) {
    if (seed) {
      return Error{fmt::format(
          "none of the {} postures that reach it has the stated configuration; check base, tool "
          "and the joint zeros of the cell",
          all)};
    }
    return Error{fmt::format(
        "the posture is not known: where the motion starts is not known{}, and none of the {} "
        "postures that reach it has the stated configuration; correct the configuration, or let "
        "the program start with a motion to joint angles",
        no_seed, all)};
  }
  const auto distance = [&](const JointVector& q) {
    return seed ? (q - *seed).cwiseAbs().maxCoeff() : q.cwiseAbs().maxCoeff();
  };
  const auto nearest = std::ranges::min_element(postures, {}, distance);
  if (!seed) {
    const auto other = std::ranges::count_if(postures, [&](const JointVector& q) {
      return DifferenceWithoutTurns(chain, q, *nearest) >= kSameJoint;
    });
    if (other > 0) {
      return Error{
          fmt::format("the posture is not known: {}, and where the motion starts is not "
                      "known{}",
                      question.states ? "several postures have the stated configuration"
                                      : "the point states none",
                      no_seed)};
    }
  }
  return *nearest;
}

}  // namespace

std::optional<JointVector> PostureNear(const correction::Corrector& corrector,
                                       const ArmTarget& target, const JointVector& seed) {
  JointVector q = seed;
  if (!Solve(corrector, target, q).converged) return std::nullopt;
  if (!kinematics::WrapIntoLimits(corrector.arm().chain(), seed, q)) return std::nullopt;
  return q;
}

std::vector<JointVector> PosturesOf(const correction::Corrector& corrector,
                                    const ArmTarget& target) {
  return WithTurns(corrector.arm().chain(), BranchesOf(corrector, target));
}

Result<JointVector> PostureSearch::Choose(const PostureQuestion& question) {
  const kinematics::Chain& chain = corrector_.arm().chain();
  if (question.seed) {
    std::optional<JointVector> near =
        question.along ? Followed(corrector_, question.along, *question.seed)
                       : PostureNear(corrector_, question.target, *question.seed);
    if (near && !question.along &&
        correction::IsOtherPosture(chain,
                                   correction::FarthestFromTaught(chain, *question.seed, *near))) {
      near.reset();
    }
    if (near && question.along && question.agrees && !question.agrees(*near)) {
      return Error{
          "it states another posture than the one that the motion before ends in, which a linear "
          "or circular motion keeps; correct the configuration, or reach it with a joint motion"};
    }
    if (near && (!question.agrees || question.agrees(*near))) return *near;
  }
  // Postures that are followed from the last search may be incomplete: enough for a refusal, but
  // not for a choice.
  if (!last_.empty()) {
    const std::vector<JointVector> branches = BranchesFrom(corrector_, question.target, last_);
    if (!branches.empty()) {
      const Result<JointVector> chosen = OneOf(chain, question, WithTurns(chain, branches));
      if (!chosen) return chosen.failure();
    }
  }
  last_ = BranchesOf(corrector_, question.target);
  return OneOf(chain, question, WithTurns(chain, last_));
}

}  // namespace plumbline::programs
