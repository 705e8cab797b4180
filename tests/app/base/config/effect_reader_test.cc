#include <catch2/catch.hpp>

#include "app/base/config/cell_reader.h"
#include "tests/app/base/config/wrong_line.h"

namespace plumbline::effect_reader_test {

using namespace plumbline::config;

namespace {

// The example of the file formats.
const std::string kGood = R"toml(
[[effect]]
id = "joint_compliance"
scope = ["q2", "q3"]
parameters = [ { name = "q2", value = 5.1e-7, sd = 2e-9, unit = "rad/(N m)" }, { name = "q3", value = 6.0e-7 } ]
covariance = [[4e-18, 1e-19], [1e-19, 9e-18]]
from = { file = "measured.csv", rows = 96, date = "2026-11-21" }
)toml";

std::vector<model::WrittenEffect> ReadEffects(const std::string& text, FaultList& faults) {
  TomlDocument document(text, "cell.toml", faults);
  std::vector<model::WrittenEffect> effects;
  for (const TomlTable& table : document.Root().Tables("effect")) {
    effects.push_back(EffectFromToml(table, 6));
  }
  document.ReportUnknownKeys();
  faults.SortByLine();
  return effects;
}

TEST_CASE("An effect is read with its parameters, covariance and origin") {
  FaultList faults;
  const auto effects = ReadEffects(kGood, faults);
  CHECK(FaultsText(faults).empty());
  REQUIRE(effects.size() == 1);
  const model::WrittenEffect& effect = effects[0];
  CHECK(effect.id == "joint_compliance");
  CHECK(effect.scope == std::vector<std::string>{"q2", "q3"});
  REQUIRE(effect.parameters.size() == 2);
  CHECK(effect.parameters[0].name == "q2");
  CHECK(effect.parameters[0].value == 5.1e-7);
  CHECK(effect.parameters[0].sd == 2e-9);
  CHECK(effect.parameters[1].unit == "rad/(N m)");
  CHECK_FALSE(effect.parameters[1].sd);
  REQUIRE(effect.covariance.rows() == 2);
  CHECK(effect.covariance(0, 1) == 1e-19);
  CHECK(effect.from_file == "measured.csv");
  CHECK(effect.from_rows == 96);
  CHECK(effect.from_date == "2026-11-21");
}

TEST_CASE("The earlier unit of a prismatic joint is a warning and keeps the value") {
  FaultList faults;
  TomlDocument document(
      "[[effect]]\nid = \"joint_offset\"\nscope = [\"q1\", \"q2\"]\n"
      "parameters = [ { name = \"q1\", value = 8e-4, unit = \"rad\" }, { name = \"q2\", value = "
      "6e-4, unit = \"rad\" } ]\n",
      "cell.toml", faults);
  constexpr std::uint32_t kFirstSlides = 1;
  const model::WrittenEffect effect =
      EffectFromToml(document.Root().Tables("effect").front(), 6, kFirstSlides);
  REQUIRE(effect.parameters.size() == 2);
  CHECK(effect.parameters[0].value == 8e-4);
  CHECK(effect.parameters[0].unit == "m");
  CHECK(effect.parameters[1].unit == "rad");
  CHECK(Texts(faults, Fault::Severity::kFault).empty());
  const auto warnings = Texts(faults, Fault::Severity::kWarning);
  REQUIRE(warnings.size() == 1);
  CHECK_THAT(warnings[0], Catch::Contains("the value of q1 is taken in m; write \"m\""));
}

TEST_CASE("Each faulty field of an effect gives exactly one message") {
  const char* parameters =
      "parameters = [ { name = \"q2\", value = 5.1e-7, sd = 2e-9, unit = \"rad/(N m)\" }, { name = "
      "\"q3\", value = 6.0e-7 } ]";
  const char* covariance = "covariance = [[4e-18, 1e-19], [1e-19, 9e-18]]";
  const std::vector<WrongLine> cases = {
      {"id = \"joint_compliance\"", "", "@2 effect[1].id: missing; expected a string in quotes"},
      {"scope = [\"q2\", \"q3\"]", "scope = [\"q2\", \"q7\"]",
       "effect[1].scope: [\"q2\", \"q7\"] names \"q7\", which is not one of q1..q6"},
      {"scope = [\"q2\", \"q3\"]", "scope = [\"q02\"]",
       "effect[1].scope: [\"q02\"] names \"q02\", which is not one of q1..q6"},
      {"scope = [\"q2\", \"q3\"]", "scopes = [\"q2\"]",
       "effect[1].scopes: unknown key; did you mean \"scope\"?"},
      {parameters, "parameters = [ { name = \"q2\", value = inf }, { name = \"q3\", value = 1 } ]",
       "effect[1].parameters[1].value: inf is not a finite number"},
      {parameters, "parameters = [ { name = \"q2\" }, { name = \"q3\", value = 1 } ]",
       "effect[1].parameters[1].value: missing; expected a number, -1000000000000..1000000000000"},
      {parameters, "parameters = [ { name = \"a2\", value = 1 }, { name = \"q3\", value = 1 } ]",
       "effect[1].parameters[1].name: \"a2\" is not a parameter of joint_compliance; it has q# (# "
       "is a joint, 1..6)"},
      {parameters, "parameters = [ { name = \"q2\", value = 1 }, { name = \"q2\", value = 1 } ]",
       "effect[1].parameters[2].name: \"q2\" is given twice"},
      {parameters,
       "parameters = [ { name = \"q2\", value = 1, unit = \"rad\" }, { name = \"q3\", value = 1 } "
       "]",
       "effect[1].parameters[1].unit: \"rad\" is not the unit of q#; write \"rad/(N m)\""},
      {parameters,
       "parameters = [ { name = \"q2\", value = 1, sd = -1 }, { name = \"q3\", value = 1 } ]",
       "effect[1].parameters[1].sd: -1 is outside 0..1000000000000"},
      {covariance, "covariance = [[4e-18, 1e-19]]",
       "effect[1].covariance: [[4e-18, 1e-19]] is not a list of 2 lists of 2 numbers"},
      {covariance, "covariance = [[4e-18, 1e-19], [2e-19, 9e-18]]",
       "effect[1].covariance: [[4e-18, 1e-19], [2e-19, 9e-18]] is not symmetric: row 2 column 1"},
      {covariance, "covariance = [[4e-18, 9e-18], [9e-18, 9e-18]]",
       "effect[1].covariance: [[4e-18, 9e-18], [9e-18, 9e-18]] is not positive semidefinite"},
      {covariance, "covariance = [[-4e-18, 0], [0, 9e-18]]",
       "effect[1].covariance: [[-4e-18, 0], [0, 9e-18]] has a negative variance in row 1"},
      {covariance, "covariance = [[0, 1e-19], [1e-19, 9e-18]]",
       "effect[1].covariance: [[0, 1e-19], [1e-19, 9e-18]] is not positive semidefinite"},
      {"from = { file = \"measured.csv\", rows = 96, date = \"2026-11-21\" }",
       "from = { file = \"measured.csv\", rows = -1, date = \"2026-11-21\" }",
       "effect[1].from.rows: -1 is outside 0..1000000000"},
  };
  ExpectOneFaultEach(kGood, "cell.toml", cases, [](const std::string& text, FaultList& faults) {
    ReadEffects(text, faults);
    return !faults.HasFaults();
  });
}

TEST_CASE("An unknown effect id is refused, and the known ones are listed") {
  FaultList faults;
  ReadEffects("[[effect]]\nid = \"creep\"\nparameters = []\n", faults);
  REQUIRE(faults.All().size() == 1);
  const std::string text = FaultText(faults.All()[0]);
  CHECK(text.rfind("cell.toml:2 effect[1].id: \"creep\" is not a known effect; known effects are "
                   "base_frame, ",
                   0) == 0);
  CHECK(text.find(", empirical") != std::string::npos);
}

TEST_CASE("An empirical effect with inconsistent drivers, nodes and parameters is refused") {
  const std::string good =
      "[[effect]]\nid = \"empirical\"\ndrivers = [\"t_s\"]\nnodes = [[0, 1], [1, 2]]\n"
      "parameters = [ { name = \"base_x\", value = 1 } ]\n";
  const std::vector<WrongLine> cases = {
      {"drivers = [\"t_s\"]", "drivers = []",
       "@2 effect[1].id: \"empirical\" needs one or two drivers, the names of recorded columns"},
      {"drivers = [\"t_s\"]", "drivers = [\"t_s\", \"temp_C\"]",
       "@2 effect[1].id: \"empirical\" needs in each row of nodes the drivers' values and one "
       "number a parameter, 3 in all"},
      {"nodes = [[0, 1], [1, 2]]", "nodes = [[0, 1, 2], [1, 2, 3]]",
       "@2 effect[1].id: \"empirical\" needs in each row of nodes the drivers' values and one "
       "number a parameter, 2 in all"},
      {"nodes = [[0, 1], [1, 2]]", "nodes = [[1, 1], [1, 2]]",
       "@2 effect[1].id: \"empirical\" needs nodes whose first column rises; row 2 does not"},
      {"parameters = [ { name = \"base_x\", value = 1 } ]",
       "parameters = [ { name = \"wrist_x\", value = 1 } ]",
       "effect[1].parameters[1].name: \"wrist_x\" is not a parameter of empirical; it has base_x, "
       "base_y, base_z, tip_x, tip_y, tip_z, q#, tool_bending, a#, d#, tilt_x, tilt_y (# is a "
       "joint, 1..6)"},
  };
  ExpectOneFaultEach(good, "cell.toml", cases, [](const std::string& text, FaultList& faults) {
    ReadEffects(text, faults);
    return !faults.HasFaults();
  });
}

TEST_CASE("A shear coefficient of zero is refused") {
  FaultList faults;
  ReadEffects("[[effect]]\nid = \"tool_shear\"\nparameters = [ { name = \"kappa\", value = 0 } ]\n",
              faults);
  CHECK(FaultsText(faults) ==
        "cell.toml:3 effect[1].parameters[1].value: 0 must be greater than 0\n");
}

TEST_CASE("Word parameters and numbered harmonics are read") {
  FaultList faults;
  const auto effects = ReadEffects(R"(
[[effect]]
id = "backlash"
scope = ["q1"]
parameters = [ { name = "q1", value = 1e-4 }, { name = "by", value = "move" } ]
covariance = [[1e-12]]
[[effect]]
id = "gear_periodic"
parameters = [ { name = "q3_amplitude", value = 1 }, { name = "q3_2_phase", value = 1, unit = "rad" } ]
[[effect]]
id = "empirical"
drivers = ["t_s"]
nodes = [[0, 1, 2, 3], [1, 2, 3, 4]]
parameters = [ { name = "base_x", value = 1, unit = "1" }, { name = "tip_z", value = 1 }, { name = "q6", value = 1 } ]
)",
                                   faults);
  CHECK(FaultsText(faults).empty());
  REQUIRE(effects.size() == 3);
  CHECK(effects[0].parameters[1].word == "move");
  CHECK(effects[0].covariance.rows() == 1);
  CHECK(effects[1].parameters[1].unit == "rad");
  CHECK(effects[2].drivers == std::vector<std::string>{"t_s"});
  CHECK(effects[2].nodes(1, 3) == 4.0);

  FaultList wrong;
  ReadEffects(
      "[[effect]]\nid = \"backlash\"\nparameters = [ { name = \"by\", value = \"time\" } ]\n",
      wrong);
  CHECK(FaultsText(wrong) ==
        "cell.toml:3 effect[1].parameters[1].value: \"time\" is not one of \"load\", \"move\"\n");
}

}  // namespace
}  // namespace plumbline::effect_reader_test
