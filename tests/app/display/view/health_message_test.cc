#include <catch2/catch.hpp>

#include "app/cell/view_link/view_client.h"
#include "app/display/view/panels.h"
#include "app/display/view/state_strip.h"
#include "tests/app/display/view/view_scene.h"

namespace plumbline::health_message_test {

using namespace plumbline::display;
using Catch::Contains;
using test::ViewScene;

namespace {

/// The facts of a healthy cell with two points; each test adds what is wrong.
struct Cell {
  ViewScene scene;
  cell::Carriers carriers = scene.Placed();
  ViewFacts facts;

  Cell() {
    facts.state = &scene.state;
    facts.model = &*scene.model;
    facts.carriers = std::span(&carriers, 1);
    facts.now_s = ViewScene::kNow_s;
  }
  HealthMessage Message(HealthReason reason) const {
    return MessageOf({SeverityOf(reason), reason}, facts);
  }
};

}  // namespace

TEST_CASE("a point without a correction is named with its code, and what to do about it") {
  Cell cell;
  for (cell::ViewPoint& point : cell.scene.state.points) {
    point.valid = false;
    point.code = correction::CorrectionCode::kJointLimit;
  }
  const HealthMessage all = cell.Message(HealthReason::kPointRefused);
  CHECK(all.reason == "no correction at assembly 1 (point 1) and 1 more: joint limit (code 2)");
  CHECK(all.remedy == "do not assemble there; move the station, or check min_deg and max_deg");
  cell.scene.state.points.front().code = correction::CorrectionCode::kPending;
  cell.scene.state.points.back().code = correction::CorrectionCode::kTorquesUnknown;
  const HealthMessage one = cell.Message(HealthReason::kPointRefused);
  CHECK(one.reason == "no correction at assembly 2 (point 2): link masses not declared (code 6)");
  CHECK_THAT(one.remedy, Contains("declare link_mass_kg of every link"));
}

TEST_CASE("a silent daemon: the service and the action, no path of a socket") {
  Cell cell;
  cell.facts.state = nullptr;
  cell.facts.link_problem = "plumblined is not running";
  StateStrip strip = StripOf(cell.facts);
  CHECK(strip.word == "NO DAEMON");
  CHECK(strip.reason == "plumblined is not running");
  CHECK_THAT(strip.remedy, Contains("systemctl start plumbline"));
  cell.facts.link_problem = cell::kMayNotConnect;
  CHECK_THAT(StripOf(cell.facts).remedy, Contains("as the user plumbline"));
  cell.facts.state = &cell.scene.state;
  cell.facts.link_problem = "";
  cell.scene.state.now_s -= 12;
  strip = StripOf(cell.facts);
  CHECK(strip.reason == "plumblined does not respond, last data 12 s ago");
}

TEST_CASE("doubts about points, tags and models name them") {
  Cell cell;
  cell.scene.state.points[1].basis = model::RadiusBasis::kAssumed;
  CHECK(cell.Message(HealthReason::kRadiusAssumed).reason ==
        "assembly 2 (point 2): the radius is assumed, not measured");
  cell.scene.state.points[0].extrapolated = true;
  CHECK(cell.Message(HealthReason::kExtrapolating).reason ==
        "assembly 1 (point 1): outside the calibrated range");
  cell.scene.state.monitoring.model.proposed = 3;
  CHECK(cell.Message(HealthReason::kProposalWaiting).reason == "model version 3 awaits approval");
  CHECK_THAT(cell.Message(HealthReason::kProposalWaiting).remedy, Contains("model apply 3"));
  status::CameraStatus& camera = cell.scene.state.cameras[0].status;
  camera.contradicting_count = 1;
  camera.contradicting_tags[0] = 7;
  CHECK(cell.Message(HealthReason::kFiducialMoved).reason == "reference tag 7 has moved");
  CHECK_THAT(cell.Message(HealthReason::kFiducialMoved).remedy, Contains("tag 7"));
}

TEST_CASE("every reason has a text, and every one but OK a remedy, with and without details") {
  const Cell cell;
  for (int k = 1; k <= static_cast<int>(kLastHealthReason); ++k) {
    const auto reason = static_cast<HealthReason>(k);
    if (*Describe(reason) == 0) continue;  // a number that is not used
    CAPTURE(k);
    const HealthMessage message = cell.Message(reason);
    CHECK_FALSE(message.reason.empty());
    CHECK_FALSE(message.remedy.empty());
    for (const std::string& text : {message.reason, message.remedy}) {
      CHECK(text.find(".socket") == std::string::npos);
      CHECK(text.find("systemctl start plumbline-view") == std::string::npos);
    }
  }
}

TEST_CASE("the panel of alarms says what is wrong before what to do") {
  Cell cell;
  cell.scene.state.alarms = alarm::kRobotStale;
  cell.scene.state.health = HealthOf({.alarms = alarm::kRobotStale});
  const Panel panel = PanelsOf(cell.facts).front();
  REQUIRE(panel.lines.size() == 2);
  CHECK_THAT(panel.lines[0].text, !Contains("→"));
  CHECK_THAT(panel.lines[1].text, Contains("→ check the cable to the robot"));
}

}  // namespace plumbline::health_message_test
