#include "tests/app/measure/diagnosis/simulated.h"

#include <unistd.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cstdlib>
#include <filesystem>

#include "app/base/config/cell_reader.h"
#include "app/measure/diagnosis/preparation/dataset_preparation.h"
#include "firmware-like/effects/catalogue.h"
#include "firmware-like/effects/parameter_name.h"

namespace plumbline::measure {
namespace {

namespace fs = std::filesystem;

/// The cell's prediction at each row with these effects.
std::vector<Vec3> Predicted(const MeasuredCell& data,
                            const std::vector<effects::ActiveEffect>& effects) {
  const Result<Dataset> dataset = DatasetFrom(data.cell, data.table);
  REQUIRE(dataset);
  REQUIRE(dataset->rows() == static_cast<int>(data.table.rows.size()));
  Model model = Model::Declared(*dataset);
  model.effects = effects;
  const Result<Linearisation> linear = Linearise(*dataset, model, false, 1);
  REQUIRE(linear);
  std::vector<Vec3> points;
  for (const LinearRow& row : linear->rows) points.push_back(row.p_W);
  return points;
}

}  // namespace

MeasuredCell ReadMeasuredCell(const std::string& folder) {
  config::FaultList faults;
  auto cell = config::ReadCell((fs::path(folder) / "cell.toml").string(), faults);
  INFO(config::FaultsText(faults));
  REQUIRE(cell);
  auto table =
      measure::ReadTable((fs::path(folder) / "measured.csv").string(), cell->robot.joints, faults);
  REQUIRE(table);
  return {*cell, *table};
}

MeasuredCell Simulated(const std::string& options) {
  static int number = 0;
  const fs::path folder =
      fs::temp_directory_path() /
      ("plumbline-diagnose-" + std::to_string(getpid()) + "-" + std::to_string(++number));
  const std::string command = std::string(PLUMBLINE_SIMULATE) + " " + options + " --out " +
                              folder.string() + " > /dev/null";
  REQUIRE(std::system(command.c_str()) == 0);
  MeasuredCell data = ReadMeasuredCell(folder.string());
  fs::remove_all(folder);
  return data;
}

void Remeasure(MeasuredCell& data, const std::vector<effects::ActiveEffect>& effects,
               double sigma_m, unsigned seed) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> noise(0, sigma_m);
  const std::vector<Vec3> points = Predicted(data, effects);
  for (std::size_t k = 0; k < points.size(); ++k) {
    Vec3& p_WT = *data.table.rows[k].measured_W;
    for (int axis = 0; axis < 3; ++axis) p_WT[axis] = points[k][axis] + noise(generator);
  }
}

std::vector<Vec3> DisplacementBy(const MeasuredCell& data,
                                 const std::vector<effects::ActiveEffect>& effects) {
  const std::vector<Vec3> without = Predicted(data, {});
  std::vector<Vec3> moved = Predicted(data, effects);
  for (std::size_t k = 0; k < moved.size(); ++k) moved[k] -= without[k];
  return moved;
}

effects::ActiveEffect EffectWith(const model::CellModel& cell, const std::string& id,
                                 const std::vector<std::pair<std::string, double>>& values,
                                 const std::string& word) {
  effects::ActiveEffect active;
  active.term.effect = effects::FindEffect(id);
  REQUIRE(active.term.effect != nullptr);
  const effects::EffectTraits& traits = active.term.effect->traits();
  for (const auto& [name, value] : values) {
    const auto parameter = effects::ParameterFromName(traits, name, cell.robot.size());
    REQUIRE(parameter);
    active.term.parameters.push_back(*parameter);
    active.values.push_back(value);
  }
  for (const effects::ParameterSpec& spec : traits.parameters) {
    if (spec.role != effects::ParameterRole::kWord) continue;
    const auto choices = effects::Choices(spec.words);
    const auto choice = std::find(choices.begin(), choices.end(), word);
    active.term.word = choice == choices.end() ? choices.back() : *choice;
  }
  return active;
}

}  // namespace plumbline::measure
