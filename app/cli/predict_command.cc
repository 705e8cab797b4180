// plumbline predict: predicts the position of the loaded tip at each pose of a file.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/base/config/carried_numbers.h"
#include "app/base/config/cell_reader.h"
#include "app/base/config/out_of_range.h"
#include "app/cli/commands.h"
#include "app/cli/failure.h"
#include "app/cli/number_option.h"
#include "app/cli/output_file.h"
#include "app/cli/progress.h"
#include "app/cli/rounded.h"
#include "app/cli/tip_prediction.h"
#include "app/measure/diagnosis/result/diagnosis_text.h"
#include "app/measure/table/conditions.h"
#include "app/measure/table/csv.h"
#include "firmware-like/deflection/loaded_arm.h"
#include "firmware-like/deflection/priors.h"
#include "firmware-like/effects/needed_columns.h"
#include "firmware-like/loads/numbered_load.h"
#include "firmware-like/model/cell_model.h"

namespace plumbline::cli {
namespace {

// Explanation of radii with the basis "assumed".

/// Adds "link_mass_kg of joints 2 and 3", or of all joints, unless no joint lacks the key.
template <typename Lacks>
void AddJointsThatLack(const char* key, int joints, Lacks lacks, std::vector<std::string>& list) {
  std::vector<std::string> numbers;
  for (int i = 0; i < joints; ++i) {
    if (lacks(static_cast<std::size_t>(i))) numbers.push_back(std::to_string(i + 1));
  }
  if (numbers.empty()) return;
  if (static_cast<int>(numbers.size()) == joints) {
    list.push_back(fmt::format("{} of all joints", key));
  } else {
    list.push_back(fmt::format("{} of joint{} {}", key, numbers.size() == 1 ? "" : "s",
                               measure::Listed(numbers)));
  }
}

std::vector<std::string> Undeclared(const model::CellModel& cell,
                                    const measure::MeasuredTable& poses,
                                    const deflection::DeflectionPriors& priors) {
  std::vector<std::string> list;
  const int joints = cell.robot.size();
  AddJointsThatLack(
      "compliance_rad_per_Nm", joints,
      [&](std::size_t k) { return priors.compliance[k].has_value(); }, list);
  AddJointsThatLack(
      "link_mass_kg", joints, [&](std::size_t k) { return priors.links[k].mass_sigma_ln > 0; },
      list);
  AddJointsThatLack(
      "link_com_mm", joints, [&](std::size_t k) { return !priors.links[k].com_sd_L.isZero(0); },
      list);
  if (!cell.payload_cog_F && cell.payload_items.empty()) {
    list.emplace_back("[payload]");
  } else if (!poses.recorded.payload && !poses.recorded.item) {
    list.emplace_back("payload_kg of the poses");
  }
  return list;
}

/// What the radii rest on if the cell declares all joints, links and the payload.
std::vector<std::string> Assumptions(const deflection::DeflectionPriors& priors,
                                     bool deviation_stated) {
  std::vector<std::string> list;
  if (priors.root_tilt_rad) list.emplace_back("a typical compliance of the tool's coupling");
  if (priors.base_compliance_rad_per_Nm) {
    list.emplace_back("a typical compliance of the robot's pedestal");
  }
  list.emplace_back("a typical uncertainty of the payload's mass and centre of gravity");
  if (!deviation_stated) {
    list.emplace_back(
        "a deviation of the declared deflections that is not stated "
        "(--deflection-sd)");
  }
  return list;
}

/// Lists what the cell and the poses do not declare, and the remedy. If all of it is declared,
/// lists what the radii rest on instead: see deflection/landing_uncertainty.h.
/// @param deviation_stated  the user stated the deviation of the declared deflections
std::string AssumedBasisText(const model::CellModel& cell, const measure::MeasuredTable& poses,
                             bool deviation_stated) {
  const deflection::LoadedArm arm(cell);
  const deflection::DeflectionPriors priors = deflection::PriorsOf(cell, arm);
  const std::vector<std::string> undeclared = Undeclared(cell, poses, priors);
  // A fitted model has assumed radii where it is extrapolated, or if it was edited since.
  const std::string measure =
      cell.domain ? "measure points in this region and run `plumbline diagnose` again"
                  : "fit the model to measured points with `plumbline diagnose`";
  if (!undeclared.empty()) {
    return fmt::format("typical values replace what the cell does not declare. Declare {}, or {}",
                       measure::Listed(undeclared), measure);
  }
  return fmt::format(
      "the cell declares its joints, links and payload; the radii rest on {}. To replace the "
      "assumptions, {}",
      measure::Listed(Assumptions(priors, deviation_stated)), measure);
}

struct PredictOptions {
  std::string cell, poses, align, out;
  std::optional<double> deflection_sd;
};

std::string CsvOf(const std::vector<Prediction>& predictions) {
  std::string text = "x_mm,y_mm,z_mm,u_mm,extrapolated,basis\n";
  for (const Prediction& p : predictions) {
    text += fmt::format(
        "{:.5f},{:.5f},{:.5f},{:.5f},{},{}\n", WithoutNegativeZero(1e3 * p.p_WT.x(), 5),
        WithoutNegativeZero(1e3 * p.p_WT.y(), 5), WithoutNegativeZero(1e3 * p.p_WT.z(), 5),
        1e3 * p.radius.radius_m, p.extrapolated ? 1 : 0, Describe(p.radius.basis));
  }
  return text;
}

model::DeclaredDeviation DeviationFrom(const PredictOptions& options) {
  if (!options.deflection_sd) return {};
  return {*options.deflection_sd, true};
}

/// Error message if the instrument's frame or the tip is unknown and neither the cell nor measured
/// rows determine it; nullopt otherwise.
std::optional<std::string> UnknownFrameProblem(const PredictOptions& options,
                                               const model::CellModel& cell) {
  const model::Measurement& measurement = cell.measurement;
  if (!options.align.empty() || !cell.sessions.empty()) return std::nullopt;
  if (measurement.frame_known && measurement.tool_known) return std::nullopt;
  const char* free = "frame = \"unaligned\" and tool = \"unknown\"";
  const char* missing = "base pose and tool tip";
  if (measurement.tool_known) {
    free = "frame = \"unaligned\"", missing = "base pose";
  } else if (measurement.frame_known) {
    free = "tool = \"unknown\"", missing = "tool tip";
  }
  return fmt::format(
      "{}: [measurement] has {} and no [[session]] supplies the missing {}, so the tip in the "
      "instrument's frame is unknown. Give measured rows with --align MEASURED.csv, or predict "
      "with the corrected cell of `plumbline diagnose`",
      options.cell, free, missing);
}

void WarnAboutPayload(const PredictOptions& options, const model::CellModel& cell,
                      const measure::MeasuredTable& poses) {
  if (poses.recorded.payload && !cell.payload_cog_F) {
    std::cerr << options.cell << ": without [payload] the payload_kg column of " << options.poses
              << " cannot be used; a payload of 0 is assumed\n";
  }
  if (PayloadNotRecorded(cell, poses)) {
    std::cerr << options.poses
              << ": warning: has no column payload_kg; a payload of 0 kg is assumed and every pose "
                 "counts as extrapolated\n";
  }
}

/// Warns about columns that effects of the cell depend on and the poses lack.
void WarnAboutMissingColumns(const PredictOptions& options, const model::CellModel& cell,
                             const measure::MeasuredTable& poses) {
  std::map<std::string, std::string> effect_of;  // by column
  const auto needed = effects::NeededColumns(effects::ActiveEffectsOf(cell), cell);
  if (needed.empty()) return;
  for (const effects::Conditions& moment : measure::ConditionsOf(cell, poses)) {
    for (const effects::NeededColumn& one : needed) {
      if (one.MissingFrom(moment)) effect_of.emplace(one.column, one.effect);
    }
  }
  for (const auto& [column, effect] : effect_of) {
    std::cerr << fmt::format(
        "{}: warning: {} is not given at every pose, but {} of the cell depends on it. That effect "
        "is then left out, the pose counts as extrapolated, and u_mm includes what the effect can "
        "do. Add a column {}\n",
        options.poses, column, effect, column);
  }
}

/// Warns that the radius is that of the measured temperatures if the poses state none.
void WarnAboutTemperature(const PredictOptions& options, const model::CellModel& cell,
                          const measure::MeasuredTable& poses) {
  if (!cell.domain || !cell.domain->temp_C || poses.recorded.temperature) return;
  std::cerr << fmt::format(
      "{}: warning: has no column temp_C; the radius holds for the measured {:.1f} to {:.1f} degC, "
      "and no pose counts as extrapolated because of its temperature\n",
      options.poses, cell.domain->temp_C->Hull().low, cell.domain->temp_C->Hull().high);
}

/// "lines 3, 7"; a long list is cut.
std::string LinesText(const std::vector<int>& lines) {
  constexpr std::size_t kMax = 20;
  const std::vector<int> first(
      lines.begin(), lines.begin() + static_cast<std::ptrdiff_t>(std::min(kMax, lines.size())));
  return fmt::format("line{} {}{}", lines.size() == 1 ? "" : "s", fmt::join(first, ", "),
                     lines.size() > kMax ? fmt::format(" and {} more", lines.size() - kMax) : "");
}

/// True if every assumed radius follows from the growth of the error that the fit states.
bool RestsOnGrowth(const std::vector<Prediction>& predictions) {
  return std::ranges::all_of(predictions, [](const Prediction& one) {
    return one.radius.basis != model::RadiusBasis::kAssumed || one.rests_on_growth;
  });
}

/// Warns about rows with a tool whose unknown tip was not measured in their session.
void WarnAboutTipsElsewhere(const PredictOptions& options, const measure::MeasuredTable& poses,
                            const model::CellModel& cell,
                            const std::vector<Prediction>& predictions) {
  std::map<std::pair<std::string, int>, std::vector<int>> lines_of;
  for (std::size_t k = 0; k < predictions.size(); ++k) {
    const measure::MeasuredRow& row = poses.rows[k];
    if (!predictions[k].tip_elsewhere) continue;
    lines_of[{row.session, row.tool_number.value_or(cell.tool.number.value_or(0))}].push_back(
        row.line);
  }
  for (const auto& [session_and_tool, lines] : lines_of) {
    const auto& [session, tool] = session_and_tool;
    std::cerr << fmt::format(
        "{}: warning: {}: the tip of tool {} was not measured in {}: it is that of another "
        "session, "
        "or the declared one (within 100 mm, 95 %). These poses are extrapolated; measure some "
        "rows "
        "with that tool in this session\n",
        options.poses, LinesText(lines), tool,
        session.empty() ? std::string("the session") : "session " + session);
  }
}

/// Prints why poses are extrapolated: each input once, with the number of poses and the first.
void PrintExits(const measure::MeasuredTable& poses, const model::CellModel& cell,
                const std::vector<Prediction>& predictions) {
  struct Reason {
    int poses = 0, line = 0;
    std::string first;
  };
  std::map<std::pair<deflection::DomainExit::Input, std::size_t>, Reason> reasons;
  for (std::size_t k = 0; k < predictions.size(); ++k) {
    const measure::MeasuredRow& row = poses.rows[k];
    for (const deflection::DomainExit& exit : predictions[k].exits) {
      Reason& reason = reasons[{exit.input, exit.index}];
      if (reason.poses++ > 0) continue;
      const loads::Payload load =
          loads::LoadOf(cell, row.payload_kg, row.tool_number, row.payload_item);
      reason.first = config::ExitText(cell, exit, load.tool, load.item);
      reason.line = row.line;
    }
  }
  for (const auto& [input, reason] : reasons) {
    std::cerr << fmt::format("  extrapolated in {} pose{}: {} (line {})\n", reason.poses,
                             reason.poses == 1 ? "" : "s", reason.first, reason.line);
  }
}

/// Warning about radii that are not based on data; empty if none is assumed or unknown.
std::string BasisWarning(const std::vector<Prediction>& predictions, const model::CellModel& cell,
                         const measure::MeasuredTable& poses, const PredictOptions& options) {
  model::RadiusBasis weakest = model::RadiusBasis::kMeasured;
  for (const Prediction& one : predictions) weakest = model::Weakest(weakest, one.radius.basis);
  if (predictions.empty() || weakest > model::RadiusBasis::kAssumed) return "";
  if (weakest == model::RadiusBasis::kUnknown) {
    return "u_mm: some radii have the basis \"unknown\": there are no typical values for an axis "
           "of "
           "this arm, for example a linear axis that carries weight. Do not rely on them; fit the "
           "model to measured points with `plumbline diagnose`";
  }
  if (RestsOnGrowth(predictions)) {
    return "u_mm: the radii with the basis \"assumed\" rest on how the error grows beyond the rows "
           "that the model was fitted to. Measure points there, and run `plumbline diagnose` again";
  }
  return "u_mm: some radii have the basis \"assumed\": " +
         AssumedBasisText(cell, poses, options.deflection_sd.has_value());
}

/// True for an effect whose time axis is the row number of the fitted file: an event or a curve
/// without t_s.
bool CountsRows(const model::WrittenEffect& effect) {
  return std::find(effect.drivers.begin(), effect.drivers.end(), "row") != effect.drivers.end() ||
         std::any_of(
             effect.parameters.begin(), effect.parameters.end(),
             [](const model::EffectParameter& parameter) { return parameter.name == "row"; });
}

/// Warns about tools and payload items that the model was not fitted to, with the lines of the
/// rows.
void WarnAboutUnmeasured(const PredictOptions& options, const model::CellModel& cell,
                         const measure::MeasuredTable& poses) {
  std::map<std::string, std::vector<int>> lines_of;
  for (const measure::MeasuredRow& row : poses.rows) {
    const loads::Payload payload =
        loads::LoadOf(cell, row.payload_kg, row.tool_number, row.payload_item);
    const std::string text = config::UnmeasuredText(cell, payload.tool, payload.item);
    if (!text.empty()) lines_of[text].push_back(row.line);
  }
  for (const auto& [text, lines] : lines_of) {
    std::cerr << fmt::format(
        "{}: warning: {}: {}; these poses are extrapolated, and their radius includes what is "
        "typical of an arm that was not measured. Measure rows with it and diagnose again\n",
        options.poses, LinesText(lines), text);
  }
}

/// Warns about tools that bend or are stressed beyond linear theory, naming the first rows.
void WarnAboutLinearTheory(const PredictOptions& options, const measure::MeasuredTable& poses,
                           const std::vector<Prediction>& predictions) {
  constexpr std::size_t kMost = 5;
  std::size_t count = 0;
  for (std::size_t k = 0; k < predictions.size() && k < poses.rows.size(); ++k) {
    if (predictions[k].beyond_linear.empty() || ++count > kMost) continue;
    std::cerr << fmt::format("{}:{}: warning: {}\n", options.poses, poses.rows[k].line,
                             predictions[k].beyond_linear);
  }
  if (count > kMost) {
    std::cerr << fmt::format("{}: {} more poses are beyond linear beam theory\n", options.poses,
                             count - kMost);
  }
}

/// Treats all rows as later than those that the model was fitted to.
void PlaceAfterFittedRows(const PredictOptions& options, const model::CellModel& cell,
                          measure::MeasuredTable& poses,
                          std::optional<measure::MeasuredTable>& measured) {
  constexpr double kAfterAnyFile = 1e9;  // rows
  poses.rows_before = kAfterAnyFile;
  if (measured) measured->rows_before = kAfterAnyFile;
  for (const model::WrittenEffect& effect : cell.effects) {
    if (!CountsRows(effect)) continue;
    std::cerr << fmt::format(
        "{}: warning: {} depends on the row number in the file that it was fitted to, which has no "
        "t_s. Every pose is predicted as if it came after that file; if some came before, measure "
        "with t_s and diagnose again\n",
        options.cell, effect.id);
  }
}

int Refused(const PredictOptions& options) {
  std::cerr << options.out << ": not written\n";
  return kExitFault;
}

int Run(const PredictOptions& options) {
  const bool to_out = options.out == "-";
  for (const std::string& input : {options.cell, options.poses, options.align}) {
    if (to_out || !SameFile(options.out, input)) continue;
    std::cerr << "plumbline predict: --output would overwrite the input " << input
              << "; choose another file\n";
    return kExitUsage;
  }
  config::FaultList faults;
  std::optional<model::CellModel> cell = config::ReadCell(options.cell, faults);
  std::optional<measure::MeasuredTable> poses, measured;
  if (cell)
    poses =
        measure::ReadTable(options.poses, cell->robot.joints, faults, measure::TableUse::kPoses);
  if (cell && !options.align.empty()) {
    measured = measure::ReadTable(options.align, cell->robot.joints, faults);
    if (!measured) poses.reset();
  }
  std::cerr << config::FaultsText(faults);
  if (!cell || !poses) return Refused(options);
  if (const auto free = UnknownFrameProblem(options, *cell)) {
    std::cerr << *free << '\n';
    return Refused(options);
  }
  if (const auto problem = measure::NumberProblem(*cell, *poses)) {
    std::cerr << options.poses << ": " << *problem << '\n';
    return Refused(options);
  }
  for (const std::string& note : measure::NumberNotes(*cell, *poses)) {
    std::cerr << options.poses << ": warning: " << note << '\n';
  }
  WarnAboutPayload(options, *cell, *poses);
  WarnAboutMissingColumns(options, *cell, *poses);
  WarnAboutTemperature(options, *cell, *poses);
  WarnAboutUnmeasured(options, *cell, *poses);
  PlaceAfterFittedRows(options, *cell, *poses, measured);
  measure::FrameCovariances frames;
  if (measured) {
    constexpr int kThreads = 2;
    const Result<measure::Realignment> realigned = measure::Realign(*cell, *measured, kThreads);
    if (!realigned) {
      std::cerr << options.align << ": " << realigned.error() << '\n';
      return Refused(options);
    }
    for (const std::string& note : realigned->notes) {
      std::cerr << options.align << ": warning: " << note << '\n';
    }
    cell = realigned->cell;
    frames = realigned->covariance;
  }
  Progress progress(std::cerr, false);
  const Result<std::vector<Prediction>> predictions =
      Predict(*cell, *poses, DeviationFrom(options), frames,
              [&](std::size_t done) { progress.ShowCount(done, poses->rows.size(), "poses"); });
  progress.Clear();
  if (!predictions) {
    std::cerr << options.cell << ": " << predictions.error() << '\n';
    return Refused(options);
  }
  if (!PrintOrWriteOutput(options.out, CsvOf(*predictions), "--output")) return kExitUsage;
  const auto extrapolated =
      std::count_if(predictions->begin(), predictions->end(),
                    [](const Prediction& prediction) { return prediction.extrapolated; });
  std::cerr << fmt::format("{}: {} pose{} predicted, {} extrapolated\n",
                           to_out ? "standard output" : options.out, predictions->size(),
                           predictions->size() == 1 ? "" : "s", extrapolated);
  PrintExits(*poses, *cell, *predictions);
  WarnAboutTipsElsewhere(options, *poses, *cell, *predictions);
  WarnAboutLinearTheory(options, *poses, *predictions);
  if (const std::string warning = BasisWarning(*predictions, *cell, *poses, options);
      !warning.empty()) {
    std::cerr << warning << '\n';
  }
  if (poses->unreadable_lines.empty()) return kExitOk;
  std::cerr << fmt::format(
      "{}: {} could not be read and {} missing in the output, whose rows therefore no longer "
      "match those of the input; fix the poses and predict again\n",
      options.poses, LinesText(poses->unreadable_lines),
      poses->unreadable_lines.size() == 1 ? "is" : "are");
  return kExitFault;
}

}  // namespace

void AddPredictCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<PredictOptions>();
  CLI::App* command = app.add_subcommand(
      "predict", "Predict the position of the loaded tip at each pose of a file");
  command->add_option("cell", options->cell, "Model of the cell, CELL.toml")->required();
  command->add_option("poses", options->poses, "Poses, POSES.csv (columns as in measured.csv)")
      ->required();
  command->add_option(
      "--align", options->align,
      "Measured rows, MEASURED.csv, from which to estimate the frame or tool that [measurement] "
      "declares as unknown");
  command
      ->add_option("--output,--out", options->out,
                   "CSV file for the predicted tip positions; - is standard output")
      ->required();
  command
      ->add_option(
          "--deflection-sd", options->deflection_sd,
          "Relative standard deviation of the declared deflections; if given, the basis is "
          "\"propagated\" for a fully declared cell [0.1]")
      ->check(NumberWithin(0, 1));
  command->footer(
      "Output columns:\n"
      "  x_mm,y_mm,z_mm  tip in the measurement frame\n"
      "  u_mm            95 % radius of points measured there, including the instrument's noise; "
      "it grows with the distance from the poses that the model was fitted to; where the basis is "
      "assumed, it is an assumption, not a tested 95 %\n"
      "  extrapolated    1: outside [domain], or outside the joint limits if there is no [domain]; "
      "or the cell has a [payload] and the poses have no payload_kg (0 is assumed); or they lack a "
      "column that an effect depends on, such as t_s or temp_C\n"
      "  basis           of the radius: measured (validated on held-out rows), propagated, "
      "assumed (typical values), unknown\n\n"
      "A cell with an unknown instrument frame or tool requires --align or [[session]] frames. "
      "The\n"
      "uncertainty of the alignment widens the radius. What the rows do not determine (the tip, if "
      "all\n"
      "have one orientation) stays as declared, with a warning.\n\n"
      "Examples:\n  plumbline predict config/cells/kr210.toml config/cells/example_poses.csv \\\n"
      "      --output predicted.csv\n"
      "  plumbline predict corrected.toml poses.csv --align session2.csv \\\n"
      "      --output predicted.csv\n\n"
      "Exit codes: 0 success, 1 faults in the input (including rows that were skipped), 2 wrong\n"
      "arguments or unwritable output.");
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace plumbline::cli
