#include "firmware-like/deflection/error_growth.h"

#include <algorithm>
#include <cmath>

namespace plumbline::deflection {
namespace {

using Input = DomainExit::Input;

double Squared(double value) {
  return value * value;
}

std::span<const model::JointVector> FittedPoses(const model::CellModel& cell) {
  if (!cell.domain || !cell.domain->distant_sigma_m) return {};
  return cell.domain->poses;
}

std::vector<model::Interval> JointRanges(const model::CellModel& cell) {
  if (cell.domain) return cell.domain->q;
  std::vector<model::Interval> limits;
  for (const model::Joint& joint : cell.robot.joints) limits.push_back({joint.min, joint.max});
  return limits;
}

bool Covers(const model::Domain& domain, std::optional<int> tool) {
  return domain.tools.empty() || std::ranges::find(domain.tools, tool) != domain.tools.end();
}

bool CoversItem(const model::Domain& domain, int item) {
  if (!domain.payload_items) return item == 0;
  return std::ranges::find(*domain.payload_items, item) != domain.payload_items->end();
}

}  // namespace

bool ToolCovered(const model::CellModel& cell, int tool) {
  return !cell.domain || Covers(*cell.domain, cell.ToolAt(tool).number);
}

bool ItemCovered(const model::CellModel& cell, int item) {
  return !cell.domain || CoversItem(*cell.domain, item);
}

ErrorGrowth::ErrorGrowth(const kinematics::Chain& chain, const Vec3& tip_F,
                         const model::CellModel& cell)
    : q_(JointRanges(cell)), domain_(cell.domain), distance_(chain, tip_F, FittedPoses(cell)) {
  for (int joint = 0; joint < chain.size(); ++joint)
    turns_.push_back(domain_ && chain.RepeatsAfterTurn(joint));
  for (int tool = 0; tool < cell.tools(); ++tool) tools_.push_back(cell.ToolAt(tool).number);
  if (!domain_) return;
  domain_->poses.clear();
  if (!domain_->t_s) {
    // How the error grows with time is not known: what an effect does holds while it was seen.
    for (const model::WrittenEffect& effect : cell.effects) {
      if (!effect.seen_t_s) continue;
      if (!domain_->t_s) domain_->t_s = model::MeasuredRange{{*effect.seen_t_s}, {}};
      model::Interval& seen = domain_->t_s->intervals.front();
      seen = {std::max(seen.low, effect.seen_t_s->low), std::min(seen.high, effect.seen_t_s->high)};
    }
  }
  if (distance_.empty()) return;
  declared_m2_ = Squared(domain_->declared_sigma_m.value_or(0));
  applied_share_ = domain_->applied_share;
}

namespace {

/// Share of a measured range beyond which no held-out row tests a value. A judgement: as many
/// uniform values as a fit needs leave less beyond their extremes.
constexpr double kUntestedShare = 0.05;
constexpr double kLeastWidth = 0.4;  // of a joint that hardly moved [rad] or [m]

/// True if no fold can have tested a value: it lies outside the range of all, or between only two,
/// which fit many laws.
bool IsUntested(const model::MeasuredRange& measured, double value) {
  const model::Interval hull = measured.Hull();
  const bool between = measured.intervals.size() > 2 && hull.Contains(value);
  const double width = hull.Width() > 0 ? hull.Width() : std::abs(hull.high);
  return !between && measured.Nearest(value).DistanceOf(value) > kUntestedShare * width;
}

}  // namespace

/// Calls visit(exit, untested) for each input beyond the fitted rows.
template <typename Visit>
void ErrorGrowth::VisitExits(const OperatingPoint& at, Visit visit_exit) const {
  const auto visit = [&](const DomainExit& exit) { visit_exit(exit, !exit.variance_m2); };
  const auto beyond = [&](Input input, const std::optional<double>& value,
                          const model::MeasuredRange& measured, std::size_t index = 0) {
    if (!value) return;
    const model::Interval& nearest = measured.Nearest(*value);
    const double distance = nearest.DistanceOf(*value);
    if (distance == 0) return;
    std::optional<double> variance_m2;
    if (measured.growth) variance_m2 = Squared(*measured.growth * distance);
    // Held-out regions load the joints differently, and so test torques.
    const bool untested = !variance_m2 || (input != Input::kTorque && IsUntested(measured, *value));
    visit_exit(DomainExit{input, index, *value, nearest, variance_m2}, untested);
  };
  for (std::size_t k = 0; k < q_.size(); ++k) {
    const double q = at.q[static_cast<Eigen::Index>(k)];
    const double distance = kinematics::DistanceBeyond(q_[k], q, turns_[k]);
    if (distance == 0) continue;
    if (distance_.empty()) {
      visit(DomainExit{Input::kJoint, k, q, q_[k], {}});
    } else {
      const bool untested = distance > kUntestedShare * std::max(kLeastWidth, q_[k].Width());
      const double gained_m =
          domain_->range_growth_m.value_or(0) * distance_.lever(static_cast<int>(k)) * distance;
      const DomainExit exit{Input::kJoint, k, q, q_[k], Squared(gained_m)};
      if (gained_m > 0 || untested) visit_exit(exit, untested);
    }
  }
  if (!domain_) return;
  if (!distance_.empty()) {
    const double distance = distance_.Of(at.q), reach = domain_->reach_rad;
    const double beyond2 = Squared(distance) - Squared(reach);
    if (beyond2 > 0)
      visit(DomainExit{
          Input::kPosture, 0, distance, {0, reach}, Squared(*domain_->distant_sigma_m) * beyond2});
  }
  if (!Covers(*domain_, tools_[static_cast<std::size_t>(at.tool)]))
    visit(DomainExit{Input::kTool, 0, 0, {}, {}});
  if (!CoversItem(*domain_, at.item)) visit(DomainExit{Input::kItem, 0, 0, {}, {}});
  if (domain_->payload_kg) beyond(Input::kPayload, at.payload_kg, *domain_->payload_kg);
  if (!domain_->payload_kg && at.payload_kg.value_or(0) > 0)
    visit(DomainExit{Input::kLoadUnrecorded, 0, *at.payload_kg, {}, {}});
  if (domain_->temp_C) beyond(Input::kTemperature, at.temp_C, *domain_->temp_C);
  if (domain_->t_s) beyond(Input::kTime, at.t_s, *domain_->t_s);
  if (domain_->t_s && domain_->t_s->growth && !at.t_s)
    visit(DomainExit{Input::kTimeUnknown, 0, 0, {}, {}});
  for (const model::MeasuredTorque& torque : domain_->torques) {
    if (torque.joint < at.tau.size())
      beyond(Input::kTorque, at.tau[torque.joint], torque.range,
             static_cast<std::size_t>(torque.joint));
  }
}

ErrorGrowth::Growth ErrorGrowth::GrowthAt(const OperatingPoint& at) const {
  Growth growth;
  VisitExits(at, [&](const DomainExit& exit, bool) {
    growth.m2 += exit.variance_m2.value_or(0);
    growth.known = growth.known && exit.variance_m2;
    growth.covered = growth.covered && exit.input != Input::kTool && exit.input != Input::kItem &&
                     exit.input != Input::kLoadUnrecorded;
  });
  return growth;
}

bool ErrorGrowth::Describes(const OperatingPoint& at) const {
  return domain_ && domain_->residual_sigma_m && GrowthAt(at).known;
}

double ErrorGrowth::Kept(const Growth& growth) const {
  if (!fades() || (growth.covered && growth.m2 == 0)) return 1;
  return growth.covered ? declared_m2_ / (declared_m2_ + growth.m2) : 0;
}

double ErrorGrowth::Share(const OperatingPoint& at) const {
  return fades() ? applied_share_ * Kept(GrowthAt(at)) : 1;
}

double ErrorGrowth::Variance(const OperatingPoint& at) const {
  const Growth growth = GrowthAt(at);
  return growth.covered || !fades() ? Kept(growth) * growth.m2 : declared_m2_;
}

bool ErrorGrowth::Dominates(double gained_m2) const {
  return domain_ && gained_m2 > Squared(domain_->residual_sigma_m.value_or(0));
}

bool ErrorGrowth::Outside(const OperatingPoint& at) const {
  double added_m2 = 0;
  bool untested = false;
  VisitExits(at, [&](const DomainExit& exit, bool of_exit) {
    added_m2 += exit.variance_m2.value_or(0);
    untested = untested || of_exit;
  });
  return untested || Dominates(added_m2);
}

std::vector<DomainExit> ErrorGrowth::Exits(const OperatingPoint& at) const {
  constexpr double kNotable = 0.25;  // of the largest variance
  double largest_m2 = 0, gained_m2 = 0;
  VisitExits(at, [&](const DomainExit& exit, bool) {
    largest_m2 = std::max(largest_m2, exit.variance_m2.value_or(0));
    gained_m2 += exit.variance_m2.value_or(0);
  });
  std::vector<DomainExit> exits;
  VisitExits(at, [&](const DomainExit& exit, bool untested) {
    const bool notable = Dominates(gained_m2) && exit.variance_m2 >= kNotable * largest_m2;
    if (untested || notable) exits.push_back(exit);
  });
  std::ranges::stable_sort(exits, [](const DomainExit& a, const DomainExit& b) {
    return a.variance_m2.value_or(HUGE_VAL) > b.variance_m2.value_or(HUGE_VAL);
  });
  return exits;
}

}  // namespace plumbline::deflection
