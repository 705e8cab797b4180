// Layout of the certificate's page, its plots of errors, and empirical terms in words.
#include "app/measure/report/certificate_layout.h"

#include <catch2/catch.hpp>

#include "app/measure/diagnosis/result/diagnosis_text.h"
#include "app/measure/report/achieved_accuracy.h"
#include "app/measure/report/certificate.h"
#include "app/measure/report/figures_certificate.h"
#include "firmware-like/effects/catalogue.h"
#include "tests/app/measure/diagnosis/example_diagnosis.h"

namespace plumbline::certificate_layout_test {

using namespace plumbline::measure;
using Catch::Contains;

TEST_CASE("texts are as high as their lines; tags and entities are no text") {
  const double one = PrintedHeight_mm("<p class=\"soft\">short</p>");
  CHECK(one > 3);
  CHECK(PrintedHeight_mm("<p class=\"soft\"><b>short &plusmn;</b></p>") == one);
  CHECK(PrintedHeight_mm("<p class=\"soft\">" + std::string(300, 'x') + "</p>") > 2 * one);
  CHECK(PrintedHeight_mm("<table><tbody><tr><td>1</td></tr><tr><td>2</td></tr></tbody></table>") ==
        Approx(2 * PrintedHeight_mm("<tr><td>1</td></tr>")));
  CHECK(PrintedHeight_mm("") == 0);
}

TEST_CASE("figures are as high as the texts permit, the deciding one being larger") {
  const FigureHeights least, roomy = HeightsBeside(120, true), crowded = HeightsBeside(270, true);
  CHECK(roomy.deciding > roomy.points);
  CHECK(roomy.points > least.points);
  // 180 mm wide: both together leave no more than the margin for the estimate.
  CHECK((roomy.deciding + roomy.points) * 180.0 / kCertificateFigureWidth + 120 ==
        Approx(271).margin(1));
  CHECK(crowded.deciding == least.deciding);
  CHECK(crowded.points == least.points);
  CHECK(HeightsBeside(180, false).deciding > HeightsBeside(180, true).deciding);
}

TEST_CASE("errors before and after correction have a plot each, on its own scale") {
  measure::Diagnosis diagnosis = test::ExampleDiagnosis(measure::Verdict::kExplained);
  model::CellModel cell = test::ExampleCell();
  cell.measurement.sigma_m = 0.05e-3;
  for (measure::RowTrace& row : diagnosis.rows) {
    row.outlier = false;
    row.held_out_before = row.before = Vec3(0.03, 0, 0);
    row.held_out_after = row.after = Vec3(0.1e-3, 0, 0);
  }
  const CertificateFigure figure = PointsFigure(AchievedAccuracyOf(diagnosis, cell), 0.5e-3);
  REQUIRE(figure.panels.size() == 2);
  CHECK_THAT(figure.panels[0].script, Contains("set yrange [0:3") && Contains("first 0.5 to"));
  CHECK_THAT(figure.panels[1].script, Contains("set yrange [0:0.5") && Contains("first 0.5 to"));
  CHECK_THAT(figure.sentence, Contains("own scale"));
  // gnuplot draws a white margin around points with error bars, which hides their neighbours.
  CHECK_THAT(figure.panels[1].script, !Contains("yerrorbars"));
  diagnosis.withheld = "too few rows";
  CHECK(PointsFigure(AchievedAccuracyOf(diagnosis, cell), {}).panels.size() == 1);
}

TEST_CASE("the deciding signal is one that the effects found depend on") {
  measure::Diagnosis diagnosis = test::ExampleDiagnosis(measure::Verdict::kExplained);
  REQUIRE_FALSE(diagnosis.findings.empty());
  diagnosis.findings.resize(1);
  // Rows with the load come first, and time explains more of the residual than the load does.
  measure::SignalTrace time{"t_s", {}, 0.5, 0}, load{"payload_kg", {}, 0.5, 0};
  double at_s = 0;
  for (measure::RowTrace& row : diagnosis.rows) {
    const bool loaded = at_s < static_cast<double>(diagnosis.rows.size()) / 2;
    time.values.push_back(at_s);
    load.values.push_back(loaded ? 60 : 0);
    row.outlier = false;
    row.before = Vec3(0, 0, (loaded ? -2e-3 : 0) - 1e-4 * at_s);
    row.after = Vec3::Zero();
    at_s += 1;
  }
  diagnosis.signals = {time, load};
  diagnosis.findings.front().effect.term.effect = effects::FindEffect("joint_compliance");
  CHECK_THAT(DecidingFigure(diagnosis, test::ExampleCell()).title, Contains("payload"));
  diagnosis.findings.front().effect.term.effect = effects::FindEffect("thermal_drift");
  CHECK_THAT(DecidingFigure(diagnosis, test::ExampleCell()).title, Contains("time"));
}

TEST_CASE("an empirical term says what it changes and by how much") {
  effects::ActiveEffect effect;
  effect.term.effect = effects::FindEffect("empirical");
  effect.term.drivers = {"air_pressure_bar"};
  effect.term.parameters = {{0}, {2}};  // base_x, base_z; their nodes are in mm
  effect.term.nodes = (Eigen::MatrixXd(3, 3) << 4, 0, 0, 5, 3, -4, 6, 6.04, -8).finished();
  effect.values = {0.5, 0.5};
  const std::vector<measure::EmpiricalCurve> curves = measure::EmpiricalCurvesOf(effect);
  REQUIRE(curves.size() == 2);
  CHECK(curves[0].meaning == "the base in x");
  CHECK(curves[0].range == "0 to 3.02");
  CHECK(curves[0].unit == "mm");
  CHECK(curves[1].range == "-4.00 to 0");
  effect.term.effect = effects::FindEffect("joint_compliance");
  CHECK(measure::EmpiricalCurvesOf(effect).empty());
}

TEST_CASE("shares that do not add up to 100 % are explained") {
  measure::Diagnosis diagnosis = test::ExampleDiagnosis(measure::Verdict::kExplained);
  REQUIRE_FALSE(diagnosis.findings.empty());
  const model::CellModel cell = test::ExampleCell();
  const auto page = [&](double share) {
    for (measure::Finding& finding : diagnosis.findings) finding.share_of_residual = share;
    const AchievedAccuracy achieved = AchievedAccuracyOf(diagnosis, cell);
    return CertificatePage({diagnosis, cell, {}, achieved, {}, {}, ""});
  };
  const auto count = static_cast<double>(diagnosis.findings.size());
  CHECK_THAT(page(1.3 / count), Contains("act alike add up to more"));
  CHECK_THAT(page(0.4 / count), Contains("act alike add up to less"));
  CHECK_THAT(page(0.9 / count), !Contains("act alike"));
}

}  // namespace plumbline::certificate_layout_test
