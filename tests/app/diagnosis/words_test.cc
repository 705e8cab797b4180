// Digits and sentences of summary and report.
#include "app/diagnosis/words.h"

#include <catch2/catch.hpp>
#include <limits>

#include "firmware-like/effects/catalogue.h"
#include "tests/app/diagnosis/example_diagnosis.h"

using namespace plumbline;

TEST_CASE("lengths carry the digits that matter") {
  const std::pair<double, const char*> cases[] = {
      {8.64321e-3, "8.64"},
      {0.0873e-3, "0.087"},
      {0.5e-3, "0.50"},
      {123.456e-3, "123.5"},
      {0.0004e-3, "<0.001"},
      {0, "0"},
      {std::numeric_limits<double>::quiet_NaN(), "unknown"}};
  for (const auto& [metres, text] : cases) CHECK(MillimetreText(metres) == text);
}

TEST_CASE("shares never claim all or nothing that is not") {
  const std::pair<double, const char*> cases[] = {
      {0.93, "93 %"}, {0.001, "<1 %"}, {0.999, ">99 %"}, {1, "100 %"}, {0, "0 %"}};
  for (const auto& [share, text] : cases) CHECK(PercentText(share) == text);
}

TEST_CASE("a value is told to the second digit of its deviation") {
  struct Case {
    double value;
    std::optional<double> sd;
    const char *value_text, *sd_text;
  };
  const Case cases[] = {{5.1e-7, 2e-9, "5.100e-07", "2.0e-09"},
                        {-0.18123, 0.0104, "-0.181", "0.010"},
                        {93.4567, 1.23, "93.5", "1.2"},
                        {1234.5, 250, "1234", "250"},
                        {0, 1e-9, "0.0e+00", "1.0e-09"},
                        {1e-9, 1, "0.0", "1.0"},
                        {0.012345678, std::nullopt, "0.01235", ""},
                        {0.5, 0.0, "0.5", ""},
                        {std::numeric_limits<double>::infinity(), 1, "unknown", ""}};
  for (const Case& c : cases) {
    const ValueText text = ValueTextOf(c.value, c.sd);
    CHECK(text.value == c.value_text);
    CHECK(text.sd == c.sd_text);
  }
}

TEST_CASE("lists and names") {
  CHECK(Listed({}).empty());
  CHECK(Listed({"a"}) == "a");
  CHECK(Listed({"a", "b", "c"}, "or") == "a, b or c");
  CHECK(EffectName("joint_compliance", {"q2", "q3"}) == "joint compliance on axes 2 and 3");
  CHECK(EffectName("gear_periodic", {"q6"}) == "periodic gear error on axis 6");
}

TEST_CASE("an unknown says what it follows and whether it is corrected") {
  Diagnosis diagnosis;
  diagnosis.verdict = Verdict::kUnknown;
  CHECK(Headline(diagnosis) ==
        "something that is not in the catalogue and follows no recorded signal; that part is not "
        "corrected");
  diagnosis.drivers = {"air_pressure_bar"};
  Finding finding;
  finding.effect.term.effect = FindEffect("empirical");
  diagnosis.findings = {finding};
  CHECK(Headline(diagnosis) ==
        "something that follows air_pressure_bar and is not in the catalogue; corrected "
        "empirically where there is data");
}

TEST_CASE("a straight line is told per unit of its signal, a bent one is not") {
  ActiveEffect effect;
  effect.term.effect = FindEffect("empirical");
  effect.term.drivers = {"air_pressure_bar"};
  effect.term.parameters = {{0}, {2}};  // base_x, base_z; their nodes are in mm
  effect.term.nodes = (Eigen::MatrixXd(3, 3) << 4, 0, 0, 5, 3, -4, 6, 6, -8).finished();
  effect.values = {0.5, 0.5};
  CHECK(LineText(effect) == "a straight line: the base moves 2.5 mm per bar (x 1.5, z -2)");
  effect.term.drivers = {"coolant_C"};
  CHECK_THAT(LineText(effect), Catch::Contains("mm per K"));
  effect.term.nodes(1, 1) = 0;
  CHECK(LineText(effect).empty());
  effect.term.effect = FindEffect("joint_compliance");
  CHECK(LineText(effect).empty());
}

TEST_CASE("without held-out rows the sentence does not claim any") {
  Diagnosis diagnosis = test::ExampleDiagnosis(Verdict::kExplained);
  CHECK(ErrorSentence(diagnosis).find("took no part in the fit") != std::string::npos);
  diagnosis.held_out_by.clear();
  CHECK(ErrorSentence(diagnosis).find("none could be held out") != std::string::npos);
  diagnosis.findings.clear();
  CHECK(ErrorSentence(diagnosis).empty());
}

TEST_CASE("an ambiguous answer says whether further poses would tell") {
  Diagnosis diagnosis = test::ExampleDiagnosis(Verdict::kAmbiguous);
  const std::string cannot = "tool stiffness or payload mass: these points cannot tell";
  CHECK(Headline(diagnosis) == cannot + "; 6 further poses would");
  diagnosis.next_poses_separate_all = false;
  CHECK(Headline(diagnosis) == cannot + "; 6 further poses may");
  diagnosis.next_poses.resize(1);
  CHECK(Headline(diagnosis) == cannot + "; one further pose may");
  diagnosis.next_poses.clear();
  CHECK(Headline(diagnosis) == cannot + ", and no further pose nearby would");
}
