#include "app/measure/report/figures_certificate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "app/measure/diagnosis/result/diagnosis.h"
#include "app/measure/diagnosis/result/diagnosis_text.h"
#include "app/measure/report/plot.h"
#include "app/measure/report/signal_bins.h"
#include "app/measure/report/words.h"

namespace plumbline::measure {
namespace {

// Signal that decides the verdict, with the component of the residual that follows it most.

/// A component of the residual.
enum class Component { kX, kY, kZ, kRadial, kTangential };

struct DecidingSignal {
  const SignalTrace* signal = nullptr;  ///< null if none was recorded
  Component component = Component::kZ;
  Cloud cloud, rejected;  ///< rejected: outliers, drawn only if they may show the cause
  double share_before = 0, share_after = 0;  ///< of the mean square
};

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
    const RowTrace& trace = diagnosis.rows[row];
    if (trace.outlier == outliers && std::isfinite(signal.values[row]) &&
        trace.before.allFinite() && trace.after.allFinite()) {
      order.push_back(row);
    }
  }
  std::ranges::stable_sort(
      order, [&](RowIndex a, RowIndex b) { return signal.values[a] < signal.values[b]; });
  Cloud cloud;
  for (const RowIndex row : order) {
    const RowTrace& trace = diagnosis.rows[row];
    const Vec3 along = DirectionAt(component, X_WB, trace.p_measured);
    cloud.value.push_back(signal.values[row]);
    cloud.before.push_back(1e3 * along.dot(trace.before));
    cloud.after.push_back(1e3 * along.dot(trace.after));
  }
  return cloud;
}

/// Whether one of the effects found depends on the signal. Time and temperature often change along
/// with what does, such as the payload, but explain nothing then.
bool MayExplain(const SignalTrace& signal, const Diagnosis& diagnosis) {
  const bool time = signal.name == "t_s" || signal.name == "row";
  if (!time && signal.name != "temp_C") return true;
  return std::ranges::any_of(diagnosis.findings, [time](const Finding& finding) {
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
    if (std::ranges::find(names, signal.name) != names.end()) {
      drivers.push_back(&signal);
    }
  }
  return drivers.empty() ? all : drivers;
}

/// "in x", "away from the base's axis".
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

/// A cloud with further points, sorted again.
Cloud Joined(const Cloud& a, const Cloud& b) {
  std::vector<std::array<double, 3>> points;
  for (const Cloud* cloud : {&a, &b}) {
    for (std::size_t k = 0; k < cloud->value.size(); ++k) {
      points.push_back({cloud->value[k], cloud->before[k], cloud->after[k]});
    }
  }
  std::ranges::stable_sort(points, [](const auto& p, const auto& q) { return p[0] < q[0]; });
  Cloud joined;
  for (const auto& [value, before, after] : points) {
    joined.value.push_back(value);
    joined.before.push_back(before);
    joined.after.push_back(after);
  }
  return joined;
}

/// Selects among the drivers of an unknown cause, otherwise among all signals: the signal and
/// component whose binned means explain most of the residual before correction, or, for an unknown
/// cause without drivers, after it.
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

constexpr int kTitle_px = 24, kAxis_px = 40;  // above and below a plot
constexpr const char* kTolerance = "#b42318";
constexpr double kWeakShare = 0.3;      // a signal that explains less decides nothing
constexpr double kStraightShare = 0.9;  // share of a correction that a straight line explains

struct Slope {
  double mm_per_unit, expanded;  ///< k = 2
};

/// Slope of the correction along the signal if a straight line explains it.
std::optional<Slope> CorrectionSlope(const Cloud& cloud) {
  const auto n = static_cast<double>(cloud.value.size());
  if (n < 4) return std::nullopt;
  double x = 0, y = 0, xx = 0, xy = 0, yy = 0;
  const auto correction = [&](std::size_t k) { return cloud.before[k] - cloud.after[k]; };
  for (std::size_t k = 0; k < cloud.value.size(); ++k) {
    x += cloud.value[k] / n;
    y += correction(k) / n;
  }
  for (std::size_t k = 0; k < cloud.value.size(); ++k) {
    const double dx = cloud.value[k] - x, dy = correction(k) - y;
    xx += dx * dx;
    xy += dx * dy;
    yy += dy * dy;
  }
  if (xx <= 0 || yy <= 0 || xy * xy < kStraightShare * xx * yy) return std::nullopt;
  const double slope = xy / xx;
  return Slope{slope, 2 * std::sqrt(std::max(0.0, yy - slope * xy) / (n - 2) / xx)};
}

bool MeasuresOneLength(const RowTrace& row) {
  using enum ObservationKind;
  return row.kind == kRange || row.kind == kSphere || row.kind == kPlane || row.kind == kGauge ||
         row.kind == kArtefactRange;
}

std::string DecidingSentence(const DecidingSignal& selected, bool corrected,
                             const Diagnosis& diagnosis) {
  const std::string name = ColumnInWords(selected.signal->name);
  const char* const where = NameOf(selected.component);
  const std::string before = PercentText(selected.share_before),
                    after = PercentText(selected.share_after);
  const bool unknown = diagnosis.verdict == Verdict::kUnknown;
  const auto& drivers = diagnosis.drivers;
  const bool driver = unknown && std::ranges::find(drivers, selected.signal->name) != drivers.end();
  std::string text;
  if (diagnosis.verdict == Verdict::kNoEffect || selected.share_before < kWeakShare) {
    const bool decides = unknown && selected.share_after >= kWeakShare;
    if (decides) {
      text = fmt::format("The residual {} still follows {} after correction ({} of it).", where,
                         name, after);
    } else if (driver) {
      text = fmt::format(
          "The effect outside the catalogue follows {}; averaged over all postures and loads, {} "
          "alone explains {} of the residual {}.",
          name, name, before, where);
    } else {
      text = fmt::format(
          "No single signal explains the residual; the strongest is {} with {} of the residual {}.",
          name, before, where);
    }
  } else if (corrected) {
    text = fmt::format("Before correction, {} explains {} of the residual {}; afterwards {}.", name,
                       before, where, after);
  } else {
    text = fmt::format("{} of the residual {} is explained by {}.", before, where, name);
  }
  if (corrected && selected.share_before >= kWeakShare) {
    if (const auto slope = CorrectionSlope(selected.cloud)) {
      const auto shown = ValueTextOf(slope->mm_per_unit, slope->expanded);
      text += fmt::format(" The correction changes by {} ± {} mm per {}.", shown.value, shown.sd,
                          UnitOfSignal(selected.signal->name));
    }
  }
  if (!selected.rejected.value.empty()) {
    text += " Crosses: rows rejected as outliers.";
  }
  if (std::ranges::any_of(diagnosis.rows, &MeasuresOneLength))
    text += " A row that measures one length shows the component of that length only.";
  return text +
         " Line: means over a tenth of the rows each; dashed: ±2 standard deviations of the "
         "noise.";
}

/// The smallest interval that contains all values and the noise band, widened by a margin.
std::pair<double, double> ScaleOf(const DecidingSignal& selected, bool corrected, double noise_mm) {
  double low = -noise_mm, high = noise_mm;
  for (const Cloud* cloud : {&selected.cloud, &selected.rejected}) {
    for (std::size_t k = 0; k < cloud->value.size(); ++k) {
      low = std::min({low, cloud->before[k], corrected ? cloud->after[k] : 0});
      high = std::max({high, cloud->before[k], corrected ? cloud->after[k] : 0});
    }
  }
  const double margin = std::max(0.06 * (high - low), 1e-6);
  return {low - margin, high + margin};
}

std::vector<std::vector<double>> PointsOf(const Cloud& cloud) {
  std::vector<std::vector<double>> points;
  for (std::size_t k = 0; k < cloud.value.size(); k += plot::Stride(cloud.value.size())) {
    points.push_back({cloud.value[k], cloud.before[k], cloud.after[k]});
  }
  return points;
}

/// @param column  of $points and $means
Panel DecidingPanel(const char* title, int column, const char* colour, double noise_mm,
                    bool rejected, const std::string& common) {
  Panel panel{title, "", common, ""};
  panel.script += fmt::format(
      "set title '{}' offset 0,-0.6\n"
      "plot {:.6g} with lines linecolor rgb '{}' dashtype 2, -{:.6g} with lines linecolor rgb '{}' "
      "dashtype 2, "
      "$points using 1:{} with points pointtype 7 pointsize 0.35 linecolor rgb '{}', "
      "$means using 1:{} with linespoints pointtype 7 pointsize 0.4 linecolor rgb '{}' linewidth 2",
      title, noise_mm, plot::kGrey, noise_mm, plot::kGrey, column, plot::kGrey, column, colour);
  if (rejected) {
    panel.script += fmt::format(
        ", $rejected using 1:{} with points pointtype 2 pointsize 0.6 linewidth 1.4 linecolor rgb "
        "'{}'",
        column, kTolerance);
  }
  panel.script += '\n';
  return panel;
}

/// The error at each pose with one model, with the bar from error - U (at least 0) to error + U.
Panel PointsPanel(const char* title, const Achieved& achieved, const char* colour,
                  std::optional<double> tolerance_m, const std::string& canvas) {
  const std::vector<PoseCharacteristics>& poses = achieved.characteristics.poses;
  std::vector<std::vector<double>> rows;
  double high_mm = tolerance_m ? 1e3 * *tolerance_m : 1e-6;
  for (std::size_t k = 0; k < poses.size(); k += plot::Stride(poses.size())) {
    const double error_mm = 1e3 * poses[k].accuracy_m;
    const double expanded_mm = 1e3 * achieved.BudgetOfPose(k).expanded_m();
    rows.push_back({static_cast<double>(k + 1), error_mm, std::max(0.0, error_mm - expanded_mm),
                    error_mm + expanded_mm});
    high_mm = std::max(high_mm, error_mm + expanded_mm);
  }
  Panel panel{title, "", canvas + plot::Data("poses", rows), ""};
  panel.script += fmt::format(
      "set title '{}' offset 0,-0.6\nset xrange [0:{}]\nset yrange [0:{:.6g}]\nset ytics {:.6g}\n"
      "set xlabel 'pose, in the order of measuring' offset 0,1\n"
      "set ylabel 'error (mm)' offset 0.8,0\n",
      title, poses.size() + 1, 1.06 * high_mm, plot::RoundDown(high_mm / 2.5));
  if (tolerance_m) {
    panel.script += fmt::format(
        "set arrow 1 from graph 0, first {0:.6g} to graph 1, first {0:.6g} nohead linewidth 1.4 "
        "linecolor rgb '{1}' front\n",
        1e3 * *tolerance_m, kTolerance);
  }
  // Not yerrorbars: their points have a white margin, which hides the neighbours.
  panel.script += fmt::format(
      "plot $poses using 1:3:(0):($4-$3) with vectors nohead linewidth 1 linecolor rgb '{0}', "
      "$poses using 1:2 with points pointtype 7 pointsize {1} linecolor rgb '{0}'\n",
      colour, rows.size() > 75 ? 0.3 : 0.4);
  return panel;
}

/// Canvas of one of `count` panels beside each other, with its margins.
std::string Canvas(std::size_t count, int height) {
  return plot::Begin(kCertificateFigureWidth / static_cast<int>(count), height) +
         fmt::format(
             "set lmargin 8\nset rmargin 2\nset xtics offset 0,0.5\nset tmargin at screen {:.4f}\n"
             "set bmargin at screen {:.4f}\n",
             1 - static_cast<double>(kTitle_px) / height, static_cast<double>(kAxis_px) / height);
}

}  // namespace

CertificateFigure PointsFigure(const AchievedAccuracy& achieved, std::optional<double> tolerance_m,
                               int height) {
  CertificateFigure figure;
  if (!achieved.before) return figure;
  figure.title = "Error at the measured poses";
  if (achieved.after) {
    const std::string canvas = Canvas(2, height);
    figure.panels = {
        PointsPanel("before correction", *achieved.before, plot::kInk, tolerance_m, canvas),
        PointsPanel("after correction", *achieved.after, plot::kAccent, tolerance_m, canvas)};
  } else {
    figure.panels = {PointsPanel("without correction", *achieved.before, plot::kAccent, tolerance_m,
                                 Canvas(1, height))};
  }
  const std::size_t stride = plot::Stride(achieved.before->characteristics.poses.size());
  figure.sentence = fmt::format(
      "Bar: expanded uncertainty U.{}{}{}",
      tolerance_m ? " Red: tolerance; a bar that crosses it proves neither conformity nor the "
                    "contrary."
                  : "",
      achieved.after ? " Each plot has its own scale." : "",
      stride > 1 ? fmt::format(" One pose in {} is drawn.", stride) : std::string());
  return figure;
}

CertificateFigure DecidingFigure(const Diagnosis& diagnosis, const model::CellModel& cell,
                                 int height) {
  CertificateFigure figure;
  const DecidingSignal selected = SelectSignal(diagnosis, cell);
  if (selected.signal == nullptr) return figure;
  const bool corrected = !diagnosis.findings.empty() && diagnosis.withheld.empty();
  const bool rejected = !selected.rejected.value.empty();
  const double noise_mm = 2e3 * diagnosis.sigma_m;
  const auto [bottom, top] = ScaleOf(selected, corrected, noise_mm);
  std::vector<std::vector<double>> means;
  for (const Bin& bin : BinsOf(selected.cloud)) {
    if (bin.after_gap) means.emplace_back();  // a blank line interrupts the curve
    means.push_back({bin.value, bin.before, bin.after});
  }
  const Cloud all = Joined(selected.cloud, selected.rejected);
  const double low = all.value.front(), high = all.value.back();
  const double margin = high > low ? 0.04 * (high - low) : 1;
  const std::string label = SignalLabel(selected.signal->name);
  figure.title = fmt::format("Residual {} against {}", NameOf(selected.component), label);
  std::string common = Canvas(corrected ? 2 : 1, height) +
                       plot::Data("points", PointsOf(selected.cloud)) + plot::Data("means", means);
  if (rejected) common += plot::Data("rejected", PointsOf(selected.rejected));
  common += fmt::format(
      "set xrange [{:.8g}:{:.8g}]\nset yrange [{:.6g}:{:.6g}]\nset xtics {:.6g}\n"
      "set xlabel {} offset 0,1\nset ylabel 'residual (mm)' offset 0.8,0\nset ytics {:.6g}\n",
      low - margin, high + margin, bottom, top, plot::RoundDown(high > low ? (high - low) / 3 : 1),
      GnuplotQuoted(label), plot::RoundDown((top - bottom) / 2.5));
  if (corrected) {
    figure.panels = {
        DecidingPanel("before correction", 2, plot::kInk, noise_mm, rejected, common),
        DecidingPanel("after correction", 3, plot::kAccent, noise_mm, rejected, common)};
  } else {
    figure.panels = {DecidingPanel("measured minus declared model", 2, plot::kAccent, noise_mm,
                                   rejected, common)};
  }
  figure.sentence = DecidingSentence(selected, corrected, diagnosis);
  return figure;
}

}  // namespace plumbline::measure
