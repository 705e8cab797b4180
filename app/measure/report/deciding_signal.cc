#include "app/measure/report/deciding_signal.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

namespace plumbline::measure {
namespace {

constexpr double kNearAxis_m = 1e-3;  // radial and tangential are undefined on the base's axis

/// Unit vector of a component at a point, in W.
Vec3 DirectionAt(Component component, const Pose& X_WB, const Vec3& p_W) {
  if (component <= Component::kZ) return Vec3::Unit(static_cast<int>(component));
  const Vec3 axis = X_WB.R * Vec3::UnitZ();
  const Vec3 from_axis = (p_W - X_WB.p) - axis * axis.dot(p_W - X_WB.p);
  if (from_axis.norm() < kNearAxis_m) return Vec3::Zero();
  const Vec3 radial = from_axis.normalized();
  return component == Component::kRadial ? radial : Vec3(axis.cross(radial));
}

std::vector<Component> ComponentsOf(const model::CellModel& cell) {
  std::vector<Component> all = {Component::kX, Component::kY, Component::kZ};
  if (cell.measurement.frame_known) {
    all.push_back(Component::kRadial);
    all.push_back(Component::kTangential);
  }
  return all;
}

Cloud CloudAlong(const Diagnosis& diagnosis, const SignalTrace& signal, Component component,
                 const Pose& X_WB, bool outliers) {
  std::vector<RowIndex> order;
  const std::size_t count = std::min(signal.values.size(), diagnosis.rows.size());
  for (const RowIndex row : FirstIndices<RowIndex>(count)) {
    const RowTrace& of = diagnosis.rows[row];
    if (of.outlier == outliers && std::isfinite(signal.values[row]) && of.before.allFinite() &&
        of.after.allFinite()) {
      order.push_back(row);
    }
  }
  std::stable_sort(order.begin(), order.end(),
                   [&](RowIndex a, RowIndex b) { return signal.values[a] < signal.values[b]; });
  Cloud cloud;
  for (const RowIndex row : order) {
    const RowTrace& of = diagnosis.rows[row];
    const Vec3 along = DirectionAt(component, X_WB, of.p_measured);
    cloud.value.push_back(signal.values[row]);
    cloud.before.push_back(1e3 * along.dot(of.before));
    cloud.after.push_back(1e3 * along.dot(of.after));
  }
  return cloud;
}

/// Variance of the residual, and the share of it that binned means explain, both corrected for the
/// degrees of freedom.
std::pair<double, double> ExplainedBy(const std::vector<Bin>& bins, double Bin::*mean,
                                      const std::vector<double>& residual) {
  const auto n = static_cast<double>(residual.size());
  const auto k = static_cast<double>(bins.size());
  if (n <= k || k < 2) return {0, 0};
  double sum = 0, square = 0, between = 0;
  for (const double one : residual) sum += one;
  for (const double one : residual) square += (one - sum / n) * (one - sum / n);
  for (const Bin& bin : bins) between += bin.count * std::pow(bin.*mean - sum / n, 2);
  if (square <= 0) return {0, 0};
  return {square / (n - 1), std::max(0.0, 1 - (square - between) / (n - k) / (square / (n - 1)))};
}

/// Whether one of the effects found depends on the signal. Time and temperature often change along
/// with what does, such as the payload, but explain nothing then.
bool MayExplain(const SignalTrace& signal, const Diagnosis& diagnosis) {
  const bool time = signal.name == "t_s" || signal.name == "row";
  if (!time && signal.name != "temp_C") return true;
  return std::any_of(
      diagnosis.findings.begin(), diagnosis.findings.end(), [time](const Finding& finding) {
        const effects::EffectTerm& term = finding.effect.term;
        return time ? effects::ReadsTime(term)
                    : term.effect->traits().Needs(effects::Signal::kTemperature, term.word);
      });
}

/// Signals that may decide the verdict: the drivers of an unknown cause, those on which the effects
/// of an explained one may depend, otherwise all.
std::vector<const SignalTrace*> EligibleSignals(const Diagnosis& diagnosis) {
  std::vector<const SignalTrace*> all, drivers;
  const bool explained = diagnosis.verdict == Verdict::kExplained;
  for (const SignalTrace& signal : diagnosis.signals) {
    if (explained && !MayExplain(signal, diagnosis)) continue;
    all.push_back(&signal);
    const auto& names = diagnosis.drivers;
    if (std::find(names.begin(), names.end(), signal.name) != names.end()) {
      drivers.push_back(&signal);
    }
  }
  return drivers.empty() ? all : drivers;
}

}  // namespace

const char* NameOf(Component component) {
  switch (component) {
    case Component::kX:
      return "in x";
    case Component::kY:
      return "in y";
    case Component::kZ:
      return "in z";
    case Component::kRadial:
      return "away from the base's axis";
    case Component::kTangential:
      break;
  }
  return "around the base's axis";
}

Cloud Joined(const Cloud& a, const Cloud& b) {
  std::vector<std::array<double, 3>> points;
  for (const Cloud* of : {&a, &b}) {
    for (std::size_t k = 0; k < of->value.size(); ++k) {
      points.push_back({of->value[k], of->before[k], of->after[k]});
    }
  }
  std::stable_sort(points.begin(), points.end(),
                   [](const auto& p, const auto& q) { return p[0] < q[0]; });
  Cloud joined;
  for (const auto& [value, before, after] : points) {
    joined.value.push_back(value);
    joined.before.push_back(before);
    joined.after.push_back(after);
  }
  return joined;
}

DecidingSignal SelectSignal(const Diagnosis& diagnosis, const model::CellModel& cell) {
  const bool unknown = diagnosis.verdict == Verdict::kUnknown;
  // What is left gives away a cause without a driver; otherwise what was there before correction.
  const bool by_after = unknown && diagnosis.drivers.empty();
  DecidingSignal best;
  double most = -1;
  for (const SignalTrace* const signal : EligibleSignals(diagnosis)) {
    for (const Component component : ComponentsOf(cell)) {
      DecidingSignal one{signal, component, {}, {}};
      one.cloud = CloudAlong(diagnosis, *signal, component, cell.robot.X_WB, false);
      if (unknown) {
        one.rejected = CloudAlong(diagnosis, *signal, component, cell.robot.X_WB, true);
      }
      const Cloud all = Joined(one.cloud, one.rejected);
      const std::vector<Bin> bins = BinsOf(all);
      const auto [before, share_before] = ExplainedBy(bins, &Bin::before, all.before);
      const auto [after, share_after] = ExplainedBy(bins, &Bin::after, all.after);
      one.share_before = share_before;
      one.share_after = share_after;
      const double explained = by_after ? after * share_after : before * share_before;
      if (explained <= most || one.cloud.value.empty()) continue;
      most = explained;
      best = std::move(one);
    }
  }
  return best;
}

}  // namespace plumbline::measure
