// Parameters by least squares, and which of them the rows hold.
#include "app/diagnosis/refit.h"

#include <catch2/catch.hpp>

#include "tests/app/diagnosis/simulated.h"

using namespace plumbline;

TEST_CASE("a parameter that the rows leave free is not held, others are") {
  MeasuredCell data = Simulated("--family none --robot ur10 --rows 40 --seed 3");
  const Result<Dataset> dataset = DatasetFrom(data.cell, data.table);
  REQUIRE(dataset);
  FitProblem problem = FitOfEveryRow(*dataset, 1);
  problem.sigma_m = 5e-5;
  // The first joint turns about the base's z axis: its offset is a yaw of the base.
  const auto of = [&](const std::vector<std::pair<std::string, double>>& frame) {
    Model model = Model::Declared(*dataset);
    model.effects = {EffectWith(data.cell, "joint_offset", {{"q1", 1e-6}, {"q3", 1e-6}}),
                     EffectWith(data.cell, "base_frame", frame)};
    const Result<Refit> refit = RefitModel(problem, model, {});
    REQUIRE(refit);
    REQUIRE(refit->held.size() == 3);
    return refit->held;
  };
  CHECK(of({{"yaw", 1e-6}}) == std::vector<bool>{false, true, false});
  CHECK(of({{"z", 1e-6}}) == std::vector<bool>{true, true, true});
}
