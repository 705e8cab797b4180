// Numbers and sentences of the summary and the report.
#include "app/measure/diagnosis/result/diagnosis_text.h"

#include <catch2/catch.hpp>
#include <limits>

#include "app/measure/diagnosis/output/summary.h"
#include "firmware-like/effects/catalogue.h"
#include "tests/app/measure/diagnosis/example_diagnosis.h"

namespace plumbline::diagnosis_text_test {

using namespace plumbline::measure;

TEST_CASE("signals are labelled by name and unit") {
  const std::pair<const char*, const char*> cases[] = {{"q5_deg", "joint 5 (deg)"},
                                                       {"qd2_deg_s", "speed of joint 2 (deg/s)"},
                                                       {"t_s", "time (s)"},
                                                       {"temp_C", "temperature (\u00b0C)"},
                                                       {"q7_mm", "joint 7 (mm)"},
                                                       {"tau3_Nm", "torque of joint 3 (N m)"},
                                                       {"air_pressure_bar", "air pressure (bar)"},
                                                       {"payload_kg", "payload (kg)"},
                                                       {"program_step", "program step"},
                                                       {"counter", "counter"},
                                                       {"_s", " s"}};
  for (const auto& [column, label] : cases) CHECK(SignalLabel(column) == label);
}

TEST_CASE("lengths have their significant digits") {
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

TEST_CASE("a share is never rounded to 0 % or 100 %") {
  const std::pair<double, const char*> cases[] = {
      {0.93, "93 %"}, {0.001, "<1 %"}, {0.999, ">99 %"}, {1, "100 %"}, {0, "0 %"}};
  for (const auto& [share, text] : cases) CHECK(PercentText(share) == text);
}

TEST_CASE("a length that files have in metres is shown in mm, other units as they are") {
  model::EffectParameter offset{"q1", 7.942e-4, 3.6e-6, "m", ""};
  CHECK(ShownUnitOf(offset).unit == "mm");
  CHECK(ShownValueOf(offset).value == "0.7942");
  CHECK(ShownValueOf(offset).sd == "0.0036");
  CHECK(ShownValueOf(offset, 2).sd == "0.0072");
  offset.unit = "rad";
  CHECK(ShownUnitOf(offset).unit == "rad");
  CHECK(ShownValueOf(offset).value == "7.942e-04");
  CHECK(ShownValueOf({"by", 0, std::nullopt, "", "load"}).value == "load");
}

TEST_CASE("a value is rounded to the second digit of its standard deviation") {
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

TEST_CASE("the headline of an unknown cause names its signal and whether it is corrected") {
  Diagnosis diagnosis;
  diagnosis.verdict = Verdict::kUnknown;
  CHECK(
      Headline(diagnosis) ==
      "an effect outside the catalogue that follows no single recorded signal; the unknown part is "
      "not corrected");
  diagnosis.drivers = {"air_pressure_bar"};
  Finding finding;
  finding.effect.term.effect = effects::FindEffect("empirical");
  diagnosis.findings = {finding};
  CHECK(Headline(diagnosis) ==
        "an effect outside the catalogue that follows air_pressure_bar; the unknown part is "
        "corrected empirically, within the measured range");
}

TEST_CASE("a linear empirical term is stated per unit of its signal, a nonlinear one is not") {
  effects::ActiveEffect effect;
  effect.term.effect = effects::FindEffect("empirical");
  effect.term.drivers = {"air_pressure_bar"};
  effect.term.parameters = {{0}, {2}};  // base_x, base_z; their nodes are in mm
  effect.term.nodes = (Eigen::MatrixXd(3, 3) << 4, 0, 0, 5, 3, -4, 6, 6, -8).finished();
  effect.values = {0.5, 0.5};
  CHECK(LinearTrendText(effect) == "linear: the base moves 2.5 mm per bar (x 1.5, z -2)");
  effect.term.drivers = {"coolant_C"};
  CHECK_THAT(LinearTrendText(effect), Catch::Contains("mm per K"));
  effect.term.nodes(1, 1) = 0;
  CHECK(LinearTrendText(effect).empty());
  effect.term.effect = effects::FindEffect("joint_compliance");
  CHECK(LinearTrendText(effect).empty());
}

TEST_CASE("the error sentence does not claim held-out points where there are none") {
  Diagnosis diagnosis = test::ExampleDiagnosis(Verdict::kExplained);
  CHECK(ErrorSentence(diagnosis).find("on held-out points") != std::string::npos);
  diagnosis.held_out_by.clear();
  CHECK(ErrorSentence(diagnosis).find("no points could be held out") != std::string::npos);
  diagnosis.findings.clear();
  CHECK(ErrorSentence(diagnosis).empty());
}

TEST_CASE("a headline names the doubtful effects unless all of them are") {
  Diagnosis diagnosis = test::ExampleDiagnosis(Verdict::kExplained);
  diagnosis.verdict = Verdict::kAmbiguous;
  diagnosis.rivals.clear();
  const std::string names = "joint compliance on axes 2 and 3 and thermal growth";
  diagnosis.doubts = {{"thermal_growth", {}, "selected in 3 of 5 folds"}};
  CHECK(Headline(diagnosis) == names + " fit these points, but thermal growth is in doubt");
  diagnosis.doubts.push_back({"joint_compliance", {"q2", "q3"}, "selected in 2 of 5 folds"});
  CHECK(Headline(diagnosis) == names + " fit these points, but both are in doubt");
  diagnosis.findings.resize(1);
  diagnosis.doubts.erase(diagnosis.doubts.begin());
  CHECK(Headline(diagnosis) ==
        "joint compliance on axes 2 and 3 fits these points, but is in doubt");
}

TEST_CASE("the noise that contradicts the residual is named by its origin") {
  Diagnosis diagnosis = test::ExampleDiagnosis(Verdict::kExplained);
  diagnosis.declared_noise_too_small = true;
  CHECK_THAT(Headline(diagnosis), Catch::Contains("; the declared noise of 0.087 mm is too small"));
  diagnosis.row_sigma_m = diagnosis.sigma_m;
  CHECK_THAT(
      Headline(diagnosis),
      Catch::Contains("; the noise of 0.087 mm stated in the column sigma_mm is too small") &&
          Catch::Contains("correct the column"));
}

TEST_CASE("the summary states the share of the signal that a rival reproduces") {
  Diagnosis diagnosis = test::ExampleDiagnosis(Verdict::kAmbiguous);
  diagnosis.rivals.front().signal_left = 0.98;
  CHECK_THAT(SummaryText(diagnosis, {.cell = test::ExampleCell(), .details = true}),
             Catch::Contains("it reproduces 2 % of the signal"));
}

TEST_CASE("the summary begins with the verdict and is short; details have the rest") {
  const model::CellModel cell = test::ExampleCell();
  for (const Verdict verdict :
       {Verdict::kNoEffect, Verdict::kExplained, Verdict::kAmbiguous, Verdict::kUnknown}) {
    Diagnosis diagnosis = test::ExampleDiagnosis(verdict);
    for (int k = 0; k < 20; ++k) {
      diagnosis.notes.push_back("a note");
      diagnosis.not_recorded.push_back("a signal");
      if (verdict != Verdict::kNoEffect) diagnosis.findings.push_back(diagnosis.findings.front());
    }
    const std::string brief =
        SummaryText(diagnosis, {.cell = cell, .tolerance_m = 5e-4, .next_step = "go on"});
    INFO(brief);
    CHECK(std::ranges::count(brief, '\n') <= (verdict == Verdict::kExplained ? 12 : 18));
    CHECK_THAT(brief, Catch::Contains("Next: go on\n"));
    CHECK_THAT(brief, !Catch::Contains("a note"));
    const std::string details = SummaryText(diagnosis, {.cell = cell, .details = true});
    CHECK_THAT(details,
               Catch::Contains("Note: a note\n") && Catch::Contains("Not recorded: a signal\n"));
  }
  Diagnosis explained = test::ExampleDiagnosis(Verdict::kExplained);
  CHECK(SummaryText(explained, {.cell = cell}).starts_with("EXPLAINED: "));
  CHECK_THAT(SummaryText(explained, {.cell = cell, .tolerance_m = 5e-4}),
             Catch::Contains("; tolerance 0.50 mm\n"));
  CHECK(SummaryText(test::ExampleDiagnosis(Verdict::kNoEffect), {.cell = cell})
            .starts_with("NO EFFECT: "));
}

TEST_CASE("shares of correlated effects that add to more than the residual are not printed") {
  Diagnosis diagnosis = test::ExampleDiagnosis(Verdict::kExplained);
  diagnosis.findings.front().share_of_residual = 0.7;
  CHECK_THAT(Headline(diagnosis), Catch::Contains("70 % of the residual"));
  diagnosis.findings.push_back(diagnosis.findings.front());
  CHECK_THAT(Headline(diagnosis), !Catch::Contains("%"));
}

TEST_CASE("an ambiguous headline states whether further poses would separate the rivals") {
  Diagnosis diagnosis = test::ExampleDiagnosis(Verdict::kAmbiguous);
  const std::string cannot = "tool stiffness or payload mass: these points cannot distinguish them";
  CHECK(Headline(diagnosis) == cannot + "; 6 further poses would");
  diagnosis.next_poses_separate_all = false;
  CHECK(Headline(diagnosis) == cannot + "; 6 further poses may, but need not");
  diagnosis.next_poses.resize(1);
  CHECK(Headline(diagnosis) == cannot + "; one further pose may, but need not");
  diagnosis.next_poses.clear();
  CHECK(Headline(diagnosis) == cannot);  // none was searched
  diagnosis.next_poses_searched = true;
  diagnosis.rival_separations = {{{}, 1e-5}, {{}, 2e-5}};
  CHECK(Headline(diagnosis) ==
        cannot +
            "; no pose separates them by more than the noise: at 2 sampled poses the choice "
            "moves the tip by at most 0.020 mm");
}

}  // namespace plumbline::diagnosis_text_test
