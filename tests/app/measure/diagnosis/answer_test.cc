// Format of DIAGNOSIS.json and next_poses.csv.
#include "app/measure/diagnosis/output/answer.h"

#include <catch2/catch.hpp>
#include <limits>

#include "app/base/text/json_text.h"
#include "app/measure/diagnosis/result/diagnosis_text.h"
#include "firmware-like/effects/catalogue.h"
#include "tests/app/measure/diagnosis/example_diagnosis.h"

namespace plumbline::answer_test {

using namespace plumbline::measure;
using test::ExampleDiagnosis;
using Json = nlohmann::ordered_json;

namespace {

std::vector<std::string> KeysOf(const Json& json) {
  std::vector<std::string> keys;
  for (const auto& [key, value] : json.items()) keys.push_back(key);
  return keys;
}

}  // namespace

TEST_CASE("the keys and their order follow the format for every verdict") {
  const std::pair<Verdict, const char*> cases[] = {{Verdict::kNoEffect, "no_effect"},
                                                   {Verdict::kExplained, "explained"},
                                                   {Verdict::kAmbiguous, "ambiguous"},
                                                   {Verdict::kUnknown, "unknown"}};
  for (const auto& [verdict, word] : cases) {
    CAPTURE(word);
    const Json answer = text::JsonOrNull<Json>(AnswerJson(ExampleDiagnosis(verdict), ""));
    CHECK(KeysOf(answer) ==
          std::vector<std::string>{"schema", "verdict", "effects", "rivals", "drivers",
                                   "next_poses", "minimum_detectable_mm", "rms_mm",
                                   "rms_by_kind_mm", "not_observable", "outlier_rows",
                                   "implausible", "discrepancy_model", "checks", "set_aside",
                                   "doubts", "held_out", "withheld", "notes"});
    CHECK(answer["schema"] == 1);
    CHECK(answer["verdict"] == word);
    CHECK(answer["next_poses"].is_null());
    CHECK(KeysOf(answer["rms_mm"]) == std::vector<std::string>{"before", "after", "before_held_out",
                                                               "after_held_out", "noise_floor"});
    CHECK(answer["outlier_rows"] == Json({17, 54}));
  }
}

TEST_CASE("checks, doubts and all held-out errors are listed with their figures") {
  Diagnosis diagnosis = ExampleDiagnosis(Verdict::kAmbiguous);
  diagnosis.checks = {{"selection_frequency", "backlash", false, 0.4, 0.8, "selected by 2 of 5"},
                      {"held_out_error", "", true, 0.09, 0.1, "within the noise"}};
  diagnosis.doubts = {{"backlash", {"q4"}, "selected by 2 of 5"}};
  diagnosis.held_out_by_all = {{"sessions", 2e-3, 1e-4, 5e-5, 2e-4}};
  diagnosis.withheld = "worse than the declared model";
  diagnosis.notes = {"joint q6 never moved"};
  const Json answer = text::JsonOrNull<Json>(AnswerJson(diagnosis, ""));
  CHECK(answer["notes"] == Json({"joint q6 never moved"}));
  CHECK(answer["checks"][0] == Json({{"name", "selection_frequency"},
                                     {"effect", "backlash"},
                                     {"passed", false},
                                     {"figure", 0.4},
                                     {"limit", 0.8},
                                     {"in_words", "selected by 2 of 5"}}));
  CHECK(answer["checks"][1]["effect"].is_null());
  CHECK(answer["doubts"] ==
        Json::array({{{"id", "backlash"}, {"scope", {"q4"}}, {"reason", "selected by 2 of 5"}}}));
  CHECK(answer["held_out"][0]["by"] == "sessions");
  CHECK(answer["held_out"][0]["after_mm"].get<double>() == Approx(0.1));
  CHECK(answer["withheld"] == "worse than the declared model");
}

TEST_CASE("effects have names, values and standard deviations in file units") {
  Diagnosis diagnosis = ExampleDiagnosis(Verdict::kExplained);
  const Json effects = text::JsonOrNull<Json>(AnswerJson(diagnosis, ""))["effects"];
  REQUIRE(effects.size() == 2);
  const Json& first = effects[0];
  CHECK(KeysOf(first) ==
        std::vector<std::string>{"id", "scope", "parameters", "p_value", "share_of_residual"});
  CHECK(first["id"] == "joint_compliance");
  CHECK(first["scope"] == Json({"q2", "q3"}));
  CHECK(KeysOf(first["parameters"][0]) == std::vector<std::string>{"name", "value", "sd", "unit"});
  CHECK(first["parameters"][1]["name"] == "q3");
  CHECK(first["parameters"][1]["value"].get<double>() == 6e-7);
  CHECK(first["parameters"][1]["sd"].get<double>() == Approx(3e-9).epsilon(1e-12));
  CHECK(first["parameters"][1]["unit"] == "rad/(N m)");
  CHECK(effects[1]["scope"].empty());

  diagnosis.rms_before_m = 8.64123456789012345e-3;
  CHECK(text::JsonOrNull<Json>(AnswerJson(diagnosis, ""))["rms_mm"]["before"].get<double>() ==
        8.64123456789012345e-3 * 1e3);
}

TEST_CASE("implausible values and the discrepancy model are reported") {
  Diagnosis diagnosis = ExampleDiagnosis(Verdict::kExplained);
  Json answer = text::JsonOrNull<Json>(AnswerJson(diagnosis, ""));
  CHECK(answer["implausible"] == Json::array());
  CHECK(answer["discrepancy_model"].is_null());
  diagnosis.findings[1].implausible = "alpha is that of no metal";
  diagnosis.discrepancy = {diagnosis.findings[0]};
  diagnosis.discrepancy_parameters = 9.5;
  diagnosis.discrepancy_share = 0.8;
  answer = text::JsonOrNull<Json>(AnswerJson(diagnosis, ""));
  CHECK(answer["implausible"] == Json({"thermal_growth: alpha is that of no metal"}));
  CHECK(answer["discrepancy_model"] == Json({{"parameters", 9.5}, {"share_of_correction", 0.8}}));
}

TEST_CASE("a variant is a parameter whose value is a word") {
  Diagnosis diagnosis;
  Finding finding;
  finding.effect.term = {effects::FindEffect("backlash"), {{0, 2, 1}}, "move"};
  finding.effect.values = {2e-4};
  diagnosis.findings = {finding};
  const Json parameters =
      text::JsonOrNull<Json>(AnswerJson(diagnosis, ""))["effects"][0]["parameters"];
  REQUIRE(parameters.size() == 2);
  CHECK(parameters[0] == Json({{"name", "q3"}, {"value", 2e-4}, {"sd", nullptr}, {"unit", "rad"}}));
  CHECK(parameters[1] == Json({{"name", "by"}, {"value", "move"}}));
}

TEST_CASE("rivals, drivers, detectable sizes and the name of the file of poses are written") {
  const Json ambiguous =
      text::JsonOrNull<Json>(AnswerJson(ExampleDiagnosis(Verdict::kAmbiguous), "next_poses.csv"));
  CHECK(ambiguous["next_poses"] == "next_poses.csv");
  CHECK(ambiguous["rivals"] == text::JsonOrNull<Json>(R"([{"instead_of": "tool_stiffness",
    "id": "payload_mass", "signal_left": 0.012}])"));
  const Json unknown = text::JsonOrNull<Json>(AnswerJson(ExampleDiagnosis(Verdict::kUnknown), ""));
  CHECK(unknown["drivers"] == Json({"air_pressure_bar"}));
  const Json nothing = text::JsonOrNull<Json>(AnswerJson(ExampleDiagnosis(Verdict::kNoEffect), ""));
  CHECK(nothing["effects"].empty());
  CHECK(nothing["minimum_detectable_mm"]["backlash"].get<double>() == Approx(0.03));
}

TEST_CASE("non-finite numbers are null, and invalid UTF-8 is replaced") {
  Diagnosis diagnosis;
  diagnosis.rms_before_m = std::numeric_limits<double>::quiet_NaN();
  diagnosis.rms_after_m = std::numeric_limits<double>::infinity();
  diagnosis.drivers = {"druck_\xE4"};
  const Json answer = text::JsonOrNull<Json>(AnswerJson(diagnosis, ""));
  CHECK(answer["rms_mm"]["before"].is_null());
  CHECK(answer["rms_mm"]["after"].is_null());
  CHECK(answer["drivers"].size() == 1);
}

TEST_CASE("the proposed poses can be read back as poses of the arm") {
  model::CellModel cell = test::ExampleCell();
  Diagnosis diagnosis = ExampleDiagnosis(Verdict::kAmbiguous);
  config::FaultList faults;
  auto table = measure::TableFromCsv(NextPosesCsv(diagnosis, cell), "next_poses.csv",
                                     cell.robot.joints, faults);
  INFO(config::FaultsText(faults));
  REQUIRE(table);
  CHECK(faults.All().empty());
  REQUIRE(table->rows.size() == 6);
  CHECK(table->recorded.payload);
  CHECK(table->rows[3].payload_kg == 80);
  CHECK((table->rows[3].q - diagnosis.next_poses[3].q).cwiseAbs().maxCoeff() < 1e-7);

  cell.robot.joints[0].type = model::JointType::kPrismatic;
  cell.payload_cog_F.reset();
  const std::string text = NextPosesCsv(diagnosis, cell);
  CHECK(text.starts_with("q1_mm,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\n"));
  table = measure::TableFromCsv(text, "next_poses.csv", cell.robot.joints, faults);
  REQUIRE(table);
  CHECK(table->rows[0].q[0] == Approx(diagnosis.next_poses[0].q[0]).margin(1e-8));
}

TEST_CASE("measuring conditions have columns of their own, only if some pose needs them") {
  const model::CellModel cell = test::ExampleCell();
  Diagnosis diagnosis = ExampleDiagnosis(Verdict::kAmbiguous);
  diagnosis.next_poses.resize(2);
  NextPose& first = diagnosis.next_poses.front();
  NextPose& second = diagnosis.next_poses.back();
  first.wait_s = 1200;
  first.via_q = first.q;
  first.via_q[2] += 0.09;
  first.qd = model::JointVector::Zero(first.q.size());
  second.qd = model::JointVector::Constant(first.q.size(), 0.5);
  const std::string text = NextPosesCsv(diagnosis, cell);
  CHECK(text.substr(0, text.find('\n'))
            .ends_with(",payload_kg,qd1_deg_s,qd2_deg_s,qd3_deg_s,qd4_deg_s,qd5_deg_s,qd6_deg_s,"
                       "wait_min,measure"));
  CHECK(text.find(",20,0\n") != std::string::npos);
  CHECK(text.find(",0,1\n") != std::string::npos);
  config::FaultList faults;
  const auto table = measure::TableFromCsv(text, "next_poses.csv", cell.robot.joints, faults);
  INFO(config::FaultsText(faults));
  REQUIRE(table);
  CHECK(faults.All().empty());
  CHECK(table->further.empty());
  REQUIRE(table->rows.size() == 3);
  CHECK((table->rows[0].q - first.via_q).cwiseAbs().maxCoeff() < 1e-7);
  CHECK((table->rows[1].q - first.q).cwiseAbs().maxCoeff() < 1e-7);
  CHECK(table->rows[1].qd.isZero());
  CHECK(table->rows[2].qd[3] == Approx(0.5).epsilon(1e-6));
  CHECK(MeasuringText(first) == "wait 20 min, q3 falling, at rest");
  CHECK(MeasuringText(second) == "in motion");
  CHECK(MeasuringText(NextPose{}).empty());
}

}  // namespace plumbline::answer_test
