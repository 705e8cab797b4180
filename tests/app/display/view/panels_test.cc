#include "app/display/view/panels.h"

#include <catch2/catch.hpp>

#include "app/display/view/state_strip.h"
#include "tests/app/display/view/view_scene.h"

namespace plumbline::panels_test {

using namespace plumbline::display;
using test::ViewScene;

namespace {

/// The panels of a scene without faults, changed by the test.
struct Paneled {
  ViewScene scene;
  std::vector<cell::Carriers> carriers;
  ViewFacts facts;

  std::vector<Panel> Panels() {
    carriers = {scene.Placed()};
    facts.state = &scene.state;
    facts.carriers = carriers;
    facts.model = &*scene.model;
    facts.now_s = ViewScene::kNow_s;
    return PanelsOf(facts);
  }
  std::vector<std::string> Titles() {
    std::vector<std::string> titles;
    for (const Panel& panel : Panels()) titles.push_back(panel.title);
    return titles;
  }
  std::vector<PanelLine> Lines(const std::string& title) {
    for (const Panel& panel : Panels()) {
      if (panel.title.rfind(title, 0) == 0) return panel.lines;
    }
    FAIL("no panel " << title);
    return {};
  }
};

}  // namespace

TEST_CASE("the panels come in a fixed order, without those of what is not configured") {
  Paneled p;
  cell::ObjectTable table;
  table.distances.emplace_back();
  CHECK(p.Titles() == std::vector<std::string>{"Alarms and warnings", "Lens", "Tracking", "Robot",
                                               "Camera", "Tags", "Model"});
  p.facts.table = &table;
  CHECK(p.Titles() == std::vector<std::string>{"Alarms and warnings", "Lens", "Tracking", "Robot",
                                               "Distances", "Camera", "Tags", "Objects", "Model"});
  p.scene.state.cameras.clear();
  CHECK(p.Titles() ==
        std::vector<std::string>{"Alarms and warnings", "Robot", "Distances", "Objects", "Model"});
}

TEST_CASE("without a state the panels say why there is none") {
  ViewFacts facts;
  facts.link_problem = "plumblined does not run";
  const std::vector<Panel> panels = PanelsOf(facts);
  REQUIRE(panels.size() == 1);
  CHECK(panels[0].lines.front().text == "plumblined does not run");
  CHECK(panels[0].lines.front().tone == Tone::kBad);
}

TEST_CASE("a point is good only if nothing is known that invalidates its radius") {
  Paneled p;
  cell::ViewState& state = p.scene.state;
  cell::ViewPoint& point = state.points.front();
  CHECK(ToneOf(point, state) == Tone::kGood);
  point.basis = model::RadiusBasis::kAssumed;
  CHECK(ToneOf(point, state) == Tone::kPlain);
  state.warnings = warning::kDrift;
  CHECK(ToneOf(point, state) == Tone::kAttention);
  point.valid = false;
  CHECK(ToneOf(point, state) == Tone::kBad);
}

TEST_CASE("an undeclared number is named as the reason of an unknown payload") {
  Paneled p;
  p.scene.state.alarms = alarm::kPayloadUnknown;
  p.scene.state.health = HealthOf({.alarms = alarm::kPayloadUnknown});
  CHECK(p.Lines("Alarms").back().text == "→ set the payload");
  CHECK(StripOf(p.facts).reason == "payload unknown");
  p.scene.state.payload_problem = "tool 5 is not declared (declared: 4, 7)";
  p.scene.state.payload_remedy = "correct the number";
  CHECK(p.Lines("Alarms").back().text == "→ correct the number");
  CHECK(StripOf(p.facts).reason == "payload unknown: tool 5 is not declared (declared: 4, 7)");
  CHECK(StripOf(p.facts).remedy == "correct the number");
}

TEST_CASE("the model panel names a proposal, a refused reference and probes in quarantine") {
  Paneled p;
  CHECK(p.Lines("Model").front().text == "cell file, no stored version");
  p.scene.state.model_version = 2;
  p.scene.state.monitoring.model.proposed = 3;
  p.scene.state.monitoring.recording = true;
  p.scene.state.monitoring.probes = 20;
  p.scene.state.monitoring.reference_refused = true;
  p.scene.state.monitoring.quarantined = 1;
  const std::vector<PanelLine> lines = p.Lines("Model");
  REQUIRE(lines.size() == 4);
  CHECK(lines[0].text == "version 2 in force");
  CHECK(lines[1].text == "version 3 proposed: plumbline model apply 3");
  CHECK(lines[2].text == "20 probes, no drift check: reference probes disagree");
  CHECK(lines[3].text == "probes in quarantine: plumbline journal quarantine list");
}

TEST_CASE("lines of several cameras name their camera, the first line of each first") {
  Paneled p;
  p.scene.state.cameras[0].status.name = status::CameraName::kSide;
  const std::vector<PanelLine> lines = p.Lines("Lens");
  REQUIRE(lines.size() == 3);
  CHECK(lines[0].text == "side: valid: tags in place");
  CHECK(lines[1].text == "side: zoom 4000, stored lens 1");
  CHECK(lines[2].text == "side: focal length 1700 px");
}

}  // namespace plumbline::panels_test
