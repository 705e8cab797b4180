#include "app/cli/predict_command.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>
#include <map>

#include "app/cli/exit_codes.h"
#include "app/cli/number_option.h"
#include "app/cli/rounded.h"
#include "app/cli/same_file.h"
#include "app/config/cell_reader.h"
#include "app/config/text_file.h"
#include "app/diagnosis/realign.h"
#include "app/table/conditions.h"
#include "firmware-like/correction/correct.h"
#include "firmware-like/deflection/landing_uncertainty.h"

namespace plumbline {
namespace {

struct Options {
  std::string cell, poses, align, out;
  double deflection_sd = CorrectionLimits{}.deflection_sd;
};

constexpr int kThreads = 2;
constexpr double kLargestPayload_kg = 5000;  // as in plumbline.toml

/// Takes the rows out whose payload is none, and names them like rows that cannot be read.
void LeaveOutImpossiblePayloads(MeasuredTable& poses, FaultList& faults) {
  if (!poses.recorded.payload) return;
  std::erase_if(poses.rows, [&](const MeasuredRow& row) {
    if (row.payload_kg >= 0 && row.payload_kg <= kLargestPayload_kg) return false;
    faults.Add(
        {Fault::Severity::kWarning, poses.file, row.line, "payload_kg",
         fmt::format("{:g} is outside 0..{:g}; row not used", row.payload_kg, kLargestPayload_kg)});
    poses.unreadable_lines.push_back(row.line);
    return true;
  });
}

std::string CsvOf(const std::vector<Prediction>& predictions) {
  std::string text = "x_mm,y_mm,z_mm,u_mm,extrapolated\n";
  for (const Prediction& p : predictions) {
    text +=
        fmt::format("{:.5f},{:.5f},{:.5f},{:.5f},{}\n", WithoutMinusZero(1e3 * p.p_WT.x(), 5),
                    WithoutMinusZero(1e3 * p.p_WT.y(), 5), WithoutMinusZero(1e3 * p.p_WT.z(), 5),
                    1e3 * p.radius95_m, p.extrapolated ? 1 : 0);
  }
  return text;
}

int Refused(const Options& options) {
  std::cerr << options.out << ": not written\n";
  return kExitFault;
}

int Run(const Options& options) {
  for (const std::string& input : {options.cell, options.poses, options.align}) {
    if (!SameFile(options.out, input)) continue;
    std::cerr << "plumbline predict: --out is " << input << " itself; choose another file\n";
    return kExitUsage;
  }
  FaultList faults;
  std::optional<CellModel> cell = ReadCell(options.cell, faults);
  std::optional<MeasuredTable> poses, measured;
  if (cell) poses = ReadTable(options.poses, cell->robot.joints, faults);
  if (poses) LeaveOutImpossiblePayloads(*poses, faults);
  if (cell && !options.align.empty()) {
    measured = ReadTable(options.align, cell->robot.joints, faults);
    if (measured) LeaveOutImpossiblePayloads(*measured, faults);
    if (!measured) poses.reset();
  }
  std::cerr << FaultsText(faults);
  if (!cell || !poses) return Refused(options);
  if (poses->recorded.payload && !cell->payload_cog_F) {
    std::cerr << options.cell << ": without [payload] the payload_kg column of " << options.poses
              << " cannot be used; the payload is taken as 0\n";
  }
  if (measured) {
    const Result<CellModel> realigned = Realigned(*cell, *measured, kThreads);
    if (!realigned) {
      std::cerr << options.align << ": " << realigned.error() << '\n';
      return Refused(options);
    }
    cell = *realigned;
  }
  const Result<std::vector<Prediction>> predictions = Predict(*cell, *poses, options.deflection_sd);
  if (!predictions) {
    std::cerr << options.cell << ": " << predictions.error() << '\n';
    return Refused(options);
  }
  if (const auto why = WriteTextFile(options.out, CsvOf(*predictions))) {
    std::cerr << fmt::format("{}: cannot be written: {}; choose another --out\n", options.out,
                             why->message);
    return kExitUsage;
  }
  const auto extrapolated =
      std::count_if(predictions->begin(), predictions->end(),
                    [](const Prediction& prediction) { return prediction.extrapolated; });
  std::cerr << fmt::format("{}: {} pose{} predicted, {} extrapolated\n", options.out,
                           predictions->size(), predictions->size() == 1 ? "" : "s", extrapolated);
  // Rows that could not be read are missing in the output: say so to the shell as well.
  return poses->unreadable_lines.empty() ? kExitOk : kExitFault;
}

}  // namespace

Result<std::vector<Prediction>> Predict(const CellModel& cell, const MeasuredTable& poses,
                                        double deflection_sd) {
  struct SessionArm {
    CellModel cell;
    LoadedArm arm;
    LandingUncertainty uncertainty;
  };
  std::map<std::string, SessionArm> arms;
  std::vector<Prediction> predictions;
  const std::vector<Conditions> conditions = ConditionsOf(cell, poses);
  for (std::size_t k = 0; k < poses.rows.size(); ++k) {
    const MeasuredRow& row = poses.rows[k];
    auto known = arms.find(row.session);
    if (known == arms.end()) {
      CellModel of_session = CellOfSession(cell, row.session);
      LoadedArm arm(of_session);
      LandingUncertainty uncertainty(of_session, arm);
      known = arms.emplace(row.session, SessionArm{std::move(of_session), std::move(arm),
                                                   std::move(uncertainty)})
                  .first;
    }
    const LoadedArm& arm = known->second.arm;
    if (arm.torques_missing(poses.recorded.tau)) {
      return Error{
          "joints have a compliance, but the torques that bend them are unknown: give every link "
          "its link_mass_kg, or leave compliance_rad_per_Nm out"};
    }
    Payload payload;
    if (poses.recorded.payload && cell.payload_cog_F)
      payload = {row.payload_kg, *cell.payload_cog_F};
    LoadedState state;
    if (!arm.AtCommanded(row.q, payload, conditions[k], state)) {
      return Error{
          fmt::format("{}:{}: the sagged posture does not settle; check "
                      "payload_kg ({:g}) of the row, compliance_rad_per_Nm and link_mass_kg",
                      poses.file, row.line, row.payload_kg)};
    }
    const bool extrapolated = OutsideDomain(
        known->second.cell, row.q,
        poses.recorded.payload ? std::optional(row.payload_kg) : std::nullopt,
        poses.recorded.temperature ? std::optional(row.temp_C) : std::nullopt, conditions[k].t_s);
    const double declared_m =
        RadiusHolding95Percent(DeflectionCovariance(arm, state, deflection_sd));
    const double radius95_m = known->second.uncertainty.Radius95_m(
        arm, row.q, payload, conditions[k], declared_m, extrapolated);
    predictions.push_back({state.p_read_W, radius95_m, extrapolated});
  }
  return predictions;
}

void AddPredictCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* command =
      app.add_subcommand("predict", "Where the loaded tip is at each pose of a file");
  command->add_option("cell", options->cell, "The cell's model, CELL.toml")->required();
  command->add_option("poses", options->poses, "Poses, POSES.csv (columns as measured.csv)")
      ->required();
  command->add_option(
      "--align", options->align,
      "Measured rows, MEASURED.csv: estimate what [measurement] leaves free (frame, "
      "tool) for this session first");
  command->add_option("--out", options->out, "Predicted tip positions, a CSV file")->required();
  command
      ->add_option("--deflection-sd", options->deflection_sd,
                   "Standard deviation of a declared deflection, as a share of it")
      ->capture_default_str()
      ->check(NumberWithin(0, 1));
  command->footer(
      "Writes x_mm,y_mm,z_mm of the tip in the measurement frame, the radius u_mm that holds 95 %\n"
      "of points measured there (the instrument's noise included, once the model was fitted),\n"
      "and extrapolated (1: outside [domain], or outside the joint limits where there is none).\n\n"
      "Examples:\n  plumbline predict config/cells/kr210.toml config/cells/example_poses.csv \\\n"
      "      --out predicted.csv\n"
      "  plumbline predict corrected.toml poses.csv --align session2.csv --out predicted.csv\n\n"
      "Exit codes: 0 done, 1 faults in the input (rows left out among them), 2 wrong arguments or\n"
      "unwritable output.");
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace plumbline
