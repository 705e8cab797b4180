#include "app/cli/predict_command.h"

#include <fmt/core.h>
#include <fmt/ostream.h>

#include <fstream>
#include <iostream>
#include <map>

#include "app/cli/exit_codes.h"
#include "app/config/cell_reader.h"
#include "firmware-like/correction/correct.h"
#include "firmware-like/deflection/uncertainty.h"

namespace plumbline {
namespace {

struct Options {
  std::string cell, poses, out;
  double deflection_sd = CorrectionLimits{}.deflection_sd;
};

int Run(const Options& options) {
  FaultList faults;
  const std::optional<CellModel> cell = ReadCell(options.cell, faults);
  std::optional<MeasuredTable> poses;
  if (cell) poses = ReadTable(options.poses, cell->robot.joints, faults);
  std::cerr << FaultsText(faults);
  if (!cell || !poses) return kExitFault;
  if (poses->recorded.payload && !cell->payload_cog_F) {
    std::cerr << options.cell << ": without [payload] the payload_kg column of " << options.poses
              << " cannot be used; the payload is taken as 0\n";
  }
  const Result<std::vector<Prediction>> predictions = Predict(*cell, *poses, options.deflection_sd);
  if (!predictions) {
    std::cerr << options.cell << ": " << predictions.error() << '\n';
    return kExitFault;
  }
  std::ofstream out(options.out);
  out << "x_mm,y_mm,z_mm,u_mm,extrapolated\n";
  int extrapolated = 0;
  for (const Prediction& p : *predictions) {
    fmt::print(out, "{:.5f},{:.5f},{:.5f},{:.5f},{}\n", 1e3 * p.p_WT.x(), 1e3 * p.p_WT.y(),
               1e3 * p.p_WT.z(), 1e3 * p.radius95_m, p.extrapolated ? 1 : 0);
    extrapolated += p.extrapolated ? 1 : 0;
  }
  out.close();
  if (!out) {
    std::cerr << options.out << ": cannot be written; choose another --out\n";
    return kExitUsage;
  }
  std::cerr << fmt::format("{}: {} poses predicted, {} of them extrapolated\n", options.out,
                           predictions->size(), extrapolated);
  // Rows that could not be read are missing in the output: say so to the shell as well.
  return poses->unreadable_lines.empty() ? kExitOk : kExitFault;
}

}  // namespace

Result<std::vector<Prediction>> Predict(const CellModel& cell, const MeasuredTable& poses,
                                        double deflection_sd) {
  if (!cell.effects.empty()) {
    return Error{fmt::format("effect \"{}\" cannot be applied by this version of plumbline",
                             cell.effects.front().id)};
  }
  struct SessionArm {
    CellModel cell;
    LoadedArm arm;
  };
  std::map<std::string, SessionArm> arms;
  std::vector<Prediction> predictions;
  for (const MeasuredRow& row : poses.rows) {
    auto known = arms.find(row.session);
    if (known == arms.end()) {
      CellModel of_session = CellOfSession(cell, row.session);
      LoadedArm arm(of_session);
      known = arms.emplace(row.session, SessionArm{std::move(of_session), std::move(arm)}).first;
    }
    const LoadedArm& arm = known->second.arm;
    if (arm.torques_missing()) {
      return Error{
          "joints have a compliance, but the torques that bend them are unknown: give every link "
          "its link_mass_kg, or leave compliance_rad_per_Nm out"};
    }
    Payload payload;
    if (poses.recorded.payload && cell.payload_cog_F)
      payload = {row.payload_kg, *cell.payload_cog_F};
    LoadedState state;
    if (!arm.AtCommanded(row.q, payload, state)) {
      return Error{
          fmt::format("{}:{}: the sagged posture does not settle; check "
                      "compliance_rad_per_Nm and link_mass_kg",
                      poses.file, row.line)};
    }
    const Mat3 covariance = DeflectionCovariance(arm, state, deflection_sd);
    predictions.push_back(
        {arm.X_WB() * state.X_BT.p, RadiusHolding95Percent(covariance),
         OutsideDomain(known->second.cell, row.q,
                       poses.recorded.payload ? std::optional(row.payload_kg) : std::nullopt,
                       poses.recorded.temperature ? std::optional(row.temp_C) : std::nullopt)});
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
  command->add_option("--out", options->out, "Predicted tip positions, a CSV file")->required();
  command
      ->add_option("--deflection-sd", options->deflection_sd,
                   "Standard deviation of a declared deflection, as a share of it")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 10.0));
  command->footer(
      "Writes x_mm,y_mm,z_mm of the tip in the measurement frame, the radius u_mm that holds 95 "
      "%,\n"
      "and extrapolated (1: outside [domain], or outside the joint limits where there is none).\n\n"
      "Example:\n  plumbline predict config/cells/kr210.toml poses.csv --out predicted.csv\n\n"
      "Exit codes: 0 done, 1 faults in the input, 2 wrong arguments or unwritable output.");
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace plumbline
