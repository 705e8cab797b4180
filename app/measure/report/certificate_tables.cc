// Tables of the certificate: characteristics, uncertainty budget, poses, conformity.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>

#include "app/measure/accuracy/conformity.h"
#include "app/measure/diagnosis/result/diagnosis_text.h"
#include "app/measure/report/certificate.h"
#include "app/measure/report/html.h"

namespace plumbline::measure {
namespace {

constexpr std::size_t kMaxPoseRows = 100;
constexpr double kSecondsPerHour = 3600;

/// A characteristic's value [m] with its uncertainty.
struct Figure {
  double value_m;
  Uncertainty uncertainty;
};

/// "0.412 ± 0.085" in mm.
std::string FigureText(double value_m, double expanded_m) {
  ValueText shown = ValueTextOf(1e3 * value_m, 1e3 * expanded_m);
  const bool zero = shown.value.find_first_of("123456789") == std::string::npos;
  if (zero && shown.value.starts_with('-')) shown.value.erase(0, 1);
  return NumberHtml(shown.value) + (shown.sd.empty() ? "" : " &plusmn; " + shown.sd);
}

/// One row of the table: a characteristic, or why there is none.
struct CharacteristicRow {
  std::string name;
  std::function<std::optional<Figure>(const Achieved&)> figure;
  std::string absent;
};

Figure PoseFigure(const Achieved& achieved, std::size_t pose, double value_m) {
  const Budget budget = achieved.BudgetOfPose(pose);
  return {value_m, {budget.combined_m, budget.coverage_factor}};
}

/// The pose whose budget is largest.
std::size_t FewestCycles(const Characteristics& all) {
  const auto fewest = std::ranges::min_element(
      all.poses, [](const auto& a, const auto& b) { return a.cycles < b.cycles; });
  return static_cast<std::size_t>(fewest - all.poses.begin());
}

/// Number of cycles of the least repeatable pose, the smaller of both models.
int CyclesOfRepeatability(const AchievedAccuracy& achieved) {
  int cycles = 0;
  for (const std::optional<Achieved>* const part : {&achieved.before, &achieved.after}) {
    if (!*part || !(*part)->characteristics.least_repeatable) continue;
    const Characteristics& all = (*part)->characteristics;
    const int of_pose = all.poses[*all.least_repeatable].cycles;
    cycles = cycles == 0 ? of_pose : std::min(cycles, of_pose);
  }
  return cycles;
}

std::string ElapsedText(double elapsed_s) {
  const double hours = elapsed_s / kSecondsPerHour;
  return hours >= 1 ? fmt::format("{:.1f} h", hours) : fmt::format("{:.0f} min", 60 * hours);
}

std::optional<Figure> LargestAccuracy(const Achieved& achieved) {
  const std::size_t worst = achieved.characteristics.worst;
  return PoseFigure(achieved, worst, achieved.characteristics.poses[worst].accuracy_m);
}

/// With the uncertainty of one pose, which is an upper bound of that of the mean.
std::optional<Figure> MeanAccuracy(const Achieved& achieved) {
  return PoseFigure(achieved, FewestCycles(achieved.characteristics),
                    achieved.characteristics.mean_accuracy_m);
}

std::optional<Figure> LargestRepeatability(const Achieved& achieved) {
  const Characteristics& all = achieved.characteristics;
  if (!all.least_repeatable) return std::nullopt;
  const PoseCharacteristics& pose = all.poses[*all.least_repeatable];
  return Figure{*pose.repeatability_m, RepeatabilityUncertainty(pose)};
}

std::optional<Figure> DistanceAccuracy(const Achieved& achieved) {
  if (!achieved.characteristics.distance) return std::nullopt;
  return Figure{achieved.characteristics.distance->accuracy_m,
                DistanceUncertainty(achieved.characteristics, achieved.contributions)};
}

std::optional<Figure> Drift(const Achieved& achieved) {
  if (!achieved.characteristics.drift) return std::nullopt;
  return Figure{achieved.characteristics.drift->accuracy_m,
                DriftUncertainty(achieved.characteristics, achieved.contributions)};
}

std::vector<CharacteristicRow> CharacteristicRows(const AchievedAccuracy& achieved) {
  const Characteristics& all = achieved.before->characteristics;
  const int cycles = CyclesOfRepeatability(achieved);
  return {{"Pose accuracy AP, largest", &LargestAccuracy, ""},
          {"Pose accuracy AP, mean", &MeanAccuracy, ""},
          {cycles > 0 ? fmt::format("Repeatability RP, {} cycles", cycles) : "Repeatability RP",
           &LargestRepeatability,
           all.cycle_degrees_of_freedom > 0 ? "no pose measured three times" : "no repeated poses"},
          {all.distance
               ? fmt::format("Distance accuracy AD, {:.0f} mm", 1e3 * all.distance->commanded_m)
               : "Distance accuracy AD",
           &DistanceAccuracy, "one pose only in each session"},
          {all.drift && all.drift->elapsed_s
               ? fmt::format("Drift dAP over {}", ElapsedText(*all.drift->elapsed_s))
               : "Drift dAP",
           &Drift, "no pose visited again"}};
}

const char* SourceName(Source source) {
  switch (source) {
    case Source::kInstrument:
      return "Instrument, declared standard deviation (sigma_mm)";
    case Source::kJointReading:
      return "Resolution of the joint readings (q_step_deg)";
    case Source::kRepeatability:
      return "Repeatability";
    case Source::kModel:
      break;
  }
  return "Model and frames, fitted to the rows";
}

const char* DecisionText(Decision decision) {
  switch (decision) {
    case Decision::kConforms:
      return "kept";
    case Decision::kDoesNotConform:
      return "exceeded";
    case Decision::kNotDecided:
      break;
  }
  return "undecided";
}

Decision DecisionFor(const Achieved& achieved, std::size_t pose, double tolerance_m) {
  return Decide(achieved.characteristics.poses[pose].accuracy_m,
                achieved.BudgetOfPose(pose).expanded_m(), tolerance_m);
}

}  // namespace

std::string CharacteristicsTable(const AchievedAccuracy& achieved) {
  if (!achieved.before) {
    return "<p class=\"soft\">No characteristics of ISO 9283: " + Escape(achieved.why_none) +
           ".</p>\n";
  }
  const bool corrected = achieved.after.has_value();
  std::vector<std::string> headers = {"ISO 9283", corrected ? "Before (mm)" : "Measured (mm)"};
  if (corrected) headers.emplace_back("After (mm)");
  headers.emplace_back("k");
  HtmlTable table(headers, {0});
  for (const CharacteristicRow& row : CharacteristicRows(achieved)) {
    const auto before = row.figure(*achieved.before);
    const auto after = corrected ? row.figure(*achieved.after) : std::nullopt;
    const auto& last = corrected ? after : before;
    if (!before) {
      table.AddNote(Escape(row.name), Escape(row.absent));
      continue;
    }
    std::vector<std::string> cells = {Escape(row.name)};
    const auto text = [&row](const std::optional<Figure>& figure) {
      return figure ? FigureText(figure->value_m, figure->uncertainty.expanded_m())
                    : Escape(row.absent);
    };
    cells.push_back(text(before));
    if (corrected) cells.push_back(text(after));
    cells.push_back(last ? fmt::format("{:.2f}", last->uncertainty.coverage_factor) : "");
    table.AddRow(cells);
  }
  return table.Html();
}

std::string BudgetTable(const AchievedAccuracy& achieved, const Diagnosis& diagnosis) {
  if (!achieved.before) return "";
  const Achieved& shown = achieved.after ? *achieved.after : *achieved.before;
  const std::size_t pose = FewestCycles(shown.characteristics);
  const Budget budget = shown.BudgetOfPose(pose);
  HtmlTable table({"Contribution, one axis", "u (mm)", "Degrees of freedom", "Evaluation"}, {0, 3});
  if (!budget.instrument_known) {
    table.AddRow({"Instrument", "unknown", "", "not declared in the cell (sigma_mm)"});
  }
  for (const BudgetLine& line : budget.lines) {
    std::string how = std::isfinite(line.freedom) ? "type A" : "type B";
    if (line.source == Source::kRepeatability) {
      how += budget.repeatability_shown ? ", replicates"
                                        : ", no repeated poses: scatter of the residual instead";
    }
    table.AddRow({SourceName(line.source), Escape(MillimetreText(line.u_m)),
                  std::isfinite(line.freedom) ? fmt::format("{:.0f}", line.freedom) : "&infin;",
                  how});
  }
  table.AddRow({"Combined standard uncertainty u<sub>c</sub>",
                Escape(MillimetreText(budget.combined_m)),
                std::isfinite(budget.freedom) ? fmt::format("{:.0f}", budget.freedom) : "&infin;",
                "root sum of squares; Welch-Satterthwaite"});
  table.AddRow({fmt::format("Expanded uncertainty U, k = {:.2f}", budget.coverage_factor),
                Escape(MillimetreText(budget.expanded_m())), "", "coverage 95.45 %"},
               true);
  const int cycles = shown.characteristics.poses[pose].cycles;
  std::string html =
      table.Html() + "<p class=\"soft\">Budget of the mean error of a pose measured " +
      (cycles == 1 ? std::string("once") : fmt::format("{} times", cycles)) + ", as in the GUM. ";
  html += achieved.held_out
              ? fmt::format(
                    "The errors are those of {} rows used neither to select nor to fit the "
                    "effects (held out by {}).",
                    achieved.rows, Escape(diagnosis.held_out_by))
              : fmt::format("The errors are those of the {} rows the model was fitted to.",
                            achieved.rows);
  return html +
         " The command pose is the tip that the model predicts for the joint angles: before "
         "correction the declared model, after it the corrected one. ISO 9283 asks for 30 "
         "cycles at five poses of a cube in the workspace; these are the poses and cycles "
         "that were measured.</p>\n";
}

std::string PosesTable(const AchievedAccuracy& achieved, std::optional<double> tolerance_m) {
  if (!achieved.before) return "";
  const Achieved& last = achieved.after ? *achieved.after : *achieved.before;
  const auto& poses = last.characteristics.poses;
  std::vector<std::size_t> order(poses.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const bool all = order.size() <= kMaxPoseRows;
  if (!all) {
    std::ranges::stable_sort(order, [&poses](std::size_t a, std::size_t b) {
      return poses[a].accuracy_m > poses[b].accuracy_m;
    });
    order.resize(kMaxPoseRows);
  }
  std::vector<std::string> headers = {"Pose", "n", "Before"};
  if (achieved.after) headers.emplace_back("After");
  headers.insert(headers.end(), {"U", "RP"});
  if (tolerance_m) headers.emplace_back("Result");
  HtmlTable table(headers, {achieved.after ? 6U : 5U});
  for (const std::size_t k : order) {
    std::vector<std::string> cells = {
        fmt::format("{}", k + 1), fmt::format("{}", poses[k].cycles),
        Escape(MillimetreText(achieved.before->characteristics.poses[k].accuracy_m))};
    if (achieved.after) cells.push_back(Escape(MillimetreText(poses[k].accuracy_m)));
    cells.push_back(Escape(MillimetreText(last.BudgetOfPose(k).expanded_m())));
    cells.push_back(poses[k].repeatability_m ? Escape(MillimetreText(*poses[k].repeatability_m))
                                             : "");
    if (tolerance_m) cells.emplace_back(DecisionText(DecisionFor(last, k, *tolerance_m)));
    table.AddRow(cells);
  }
  return table.HtmlAcross(3) +
         fmt::format(
             "<p class=\"soft\">{}n: cycles. Before and after correction: pose accuracy AP; "
             "U: its expanded uncertainty; RP: repeatability; all in mm.{}</p>\n",
             all ? std::string()
                 : fmt::format("The {} of {} poses with the largest errors. ", order.size(),
                               poses.size()),
             tolerance_m ? " Result: the tolerance is kept, exceeded, or undecided by U." : "");
}

namespace {

/// Decisions at the assessed poses.
struct Decisions {
  int poses = 0, conform = 0, fail = 0;

  Decisions(const Achieved& achieved, double tolerance_m)
      : poses(static_cast<int>(achieved.characteristics.poses.size())) {
    for (std::size_t k = 0; k < achieved.characteristics.poses.size(); ++k) {
      const Decision decision = DecisionFor(achieved, k, tolerance_m);
      conform += decision == Decision::kConforms ? 1 : 0;
      fail += decision == Decision::kDoesNotConform ? 1 : 0;
    }
  }

  bool all() const { return conform == poses; }
  /// "exceeded at 3 of 80 poses"
  std::string Text() const {
    if (fail > 0) return fmt::format("exceeded at {} of {} poses", fail, poses);
    if (all()) return fmt::format("kept at all {} poses", poses);
    return fmt::format("kept at {} of {} poses, the others are too uncertain", conform, poses);
  }
};

/// Why nothing can be decided; empty if it can.
std::string WhyUndecided(const AchievedAccuracy& achieved) {
  constexpr int kFewestPoses = 5;  // of ISO 9283
  if (!achieved.before) return achieved.why_none;
  if (!achieved.before->contributions.instrument_m)
    return "the uncertainty of the instrument is not declared (sigma_mm of [measurement])";
  if (achieved.noise_refuted)
    return "the residual refutes the declared noise; measure one pose ten times";
  const auto poses = static_cast<int>(achieved.before->characteristics.poses.size());
  return poses < kFewestPoses ? fmt::format("{} pose{} measured, fewer than {}", poses,
                                            poses == 1 ? " was" : "s were", kFewestPoses)
                              : "";
}

}  // namespace

Conformity ConformityOf(const AchievedAccuracy& achieved, double tolerance_m) {
  using enum Conformity::Outcome;
  const std::string limit = "Tolerance " + MillimetreText(tolerance_m) + " mm";
  if (const std::string why = WhyUndecided(achieved); !why.empty())
    return {kNotDecided, limit + ": " + why + "."};
  const Decisions measured(*achieved.before, tolerance_m);
  const Decisions decisive = achieved.after ? Decisions(*achieved.after, tolerance_m) : measured;
  std::string text = limit;
  if (const std::string fitted = FittedText(achieved); !fitted.empty())
    text += fmt::format(", with {} fitted to {}", fitted,
                        achieved.held_out ? "the other rows" : "the same rows");
  text += ". As measured: " + measured.Text();
  if (achieved.after)
    text += "; predicted with the correction: " + decisive.Text() + ", not yet measured with it";
  text += '.';
  if (achieved.rejected_rows > 0)
    text += fmt::format(" Rejected rows, not assessed: {}.", achieved.rejected_rows);
  if (decisive.fail > 0) return {kDoesNotConform, text};
  if (!decisive.all() || achieved.rejected_rows > 0) return {kNotDecided, text};
  return {measured.all() ? kConforms : kWouldConform, text};
}

}  // namespace plumbline::measure
