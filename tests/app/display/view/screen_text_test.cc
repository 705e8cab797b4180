#include "app/display/view/screen_text.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "app/display/view/panels.h"
#include "app/display/view/state_strip.h"
#include "firmware-like/image/image_size.h"
#include "tests/app/display/view/view_scene.h"

namespace plumbline::screen_text_test {

using namespace plumbline::display;
using namespace plumbline::test;

namespace {

/// Text width with 0.6 em a character, a typical mean of proportional fonts.
float WidthOf(const std::string& text, float height_px) {
  float letters = 0;
  for (const char byte : text) letters += (static_cast<unsigned char>(byte) & 0xC0U) != 0x80U;
  return 0.6F * height_px * letters;
}

struct Drawn {
  std::vector<cell::Carriers> carriers;
  ViewFacts facts;
  PictureLayout layout;
  scene::DisplayList list;

  Drawn(ViewScene& scene, image::ImageSize size, const cell::ObjectTable* table = nullptr,
        const cell::SceneMeasurements* measured = nullptr) {
    facts.shown.clear();
    for (std::size_t k = 0; k < scene.state.cameras.size(); ++k) {
      cell::CarrierTracker memory;
      carriers.push_back(memory.Update(scene.state, k, &*scene.model, ViewScene::kNow_s));
      facts.shown.push_back(k);
    }
    facts.state = &scene.state;
    facts.carriers = carriers;
    facts.model = &*scene.model;
    facts.table = table;
    facts.measured = measured;
    facts.now_s = ViewScene::kNow_s;
    layout = LayoutFor(facts, size);
    const std::vector<int> meshes;
    list = PictureOf({facts, scene.model->config.overlay, meshes, {}}, layout, WidthOf);
  }
  bool Says(const std::string& words) const {
    return std::any_of(list.texts.begin(), list.texts.end(), [&](const scene::DrawnText& text) {
      return text.text.find(words) != std::string::npos;
    });
  }
};

/// The area that a text covers, from its capitals to its descenders.
scene::Area Of(const scene::DrawnText& text) {
  return {text.x, text.y - 0.8F * text.height_px, WidthOf(text.text, text.height_px),
          1.03F * text.height_px};
}

void ExpectTidy(const Drawn& drawn) {
  const auto& texts = drawn.list.texts;
  const auto width = static_cast<float>(drawn.layout.size.width);
  const auto height = static_cast<float>(drawn.layout.size.height);
  for (std::size_t a = 0; a < texts.size(); ++a) {
    const scene::Area first = Of(texts[a]);
    CAPTURE(texts[a].text);
    CHECK(first.x >= 0);
    CHECK(first.right() <= width + 0.5F);
    CHECK(first.y >= 0);
    CHECK(first.bottom() <= height + 0.5F);
    for (std::size_t b = a + 1; b < texts.size(); ++b) {
      const scene::Area second = Of(texts[b]);
      const bool apart = first.right() <= second.x || second.right() <= first.x ||
                         first.bottom() <= second.y + 0.5F || second.bottom() <= first.y + 0.5F;
      CAPTURE(texts[b].text);
      CHECK(apart);
    }
  }
}

void MakeEverythingLong(ViewScene& scene) {
  const std::string word(400, 'W');
  scene.state.cell = word;
  scene.state.cameras[0].serial = word;
  for (std::uint64_t k = 0; k < 40; ++k) scene.state.lines.push_back({k, 1.8e9, 3, word});
  scene.state.alarms = 0xFFFF;
  scene.state.warnings = 0xFFFF;
  scene.state.cameras[0].status.prompt = lens::BoardPrompt::kUpperLeft;
  for (int k = 0; k < 60; ++k) {
    scene.state.cameras[0].bodies.push_back({word + std::to_string(k), {}, false});
    cell::ViewPoint point;
    point.id = 100 + k;
    point.code = correction::CorrectionCode::kTooLarge;
    scene.state.points.push_back(point);
  }
}

}  // namespace

TEST_CASE("no text overlaps another or leaves the picture, at any size and amount of text") {
  for (const image::ImageSize size :
       {image::ImageSize{640, 480}, {1024, 768}, {1280, 1024}, {1920, 1080}, {1080, 1920}}) {
    ViewScene plain("exaggeration = 10.0\nstress = true\n"), full("exaggeration = 10.0\n");
    ExpectTidy(Drawn(plain, size));
    MakeEverythingLong(full);
    ExpectTidy(Drawn(full, size));
  }
}

TEST_CASE("the strip is at least 6 % high, texts of details 12 px or 15 px a metre at 1.6 m") {
  for (const image::ImageSize size :
       {image::ImageSize{640, 480}, {1600, 1200}, {1280, 1024}, {3840, 2160}, {1080, 1920}}) {
    const PictureLayout layout = LayoutOf(size);
    CHECK(layout.strip.height >= 0.06F * static_cast<float>(size.height));
    CHECK(layout.em >= 12);
    const float share = layout.image.width * layout.image.height /
                        (static_cast<float>(size.width) * static_cast<float>(size.height));
    CHECK((share >= 0.6F || layout.band.height >= 5 * layout.line()));
    CHECK(layout.tiles.height >= 6.3F * layout.em);
    CHECK(layout.tiles.width >= static_cast<float>(TileSize(layout).width));
  }
  CHECK(LayoutOf({1920, 1080}).em >= 15 * 1.6F);
}

TEST_CASE("an image of 16:9 gets 60 % of the picture, before the details") {
  for (const image::ImageSize size : {image::ImageSize{640, 480},
                                      {800, 600},
                                      {1024, 768},
                                      {1280, 1024},
                                      {1280, 720},
                                      {1600, 1200},
                                      {1920, 1080},
                                      {3840, 2160}}) {
    INFO(size.width << "x" << size.height);
    const PictureLayout layout = LayoutOf(size);
    CHECK(layout.image.width * layout.image.height >=
          0.6F * static_cast<float>(size.width) * static_cast<float>(size.height));
    CHECK(layout.band.bottom() == static_cast<float>(size.height));
    CHECK(layout.tiles.bottom() <= static_cast<float>(size.height));
  }
}

TEST_CASE("a text that is too long is cut between characters and ends in an ellipsis") {
  const auto fitted = [](const std::string& text, float letters) {
    return Elided(text, 10, letters * 6, WidthOf);
  };
  CHECK(fitted("short", 5) == "short");
  CHECK(fitted("longer", 5) == "long…");
  CHECK(fitted("to be cut", 4) == "to…");
  CHECK(fitted("größer", 5) == "größ…");
  CHECK(fitted("→→→→", 3) == "→→…");
  CHECK(fitted("abc", 0.5).empty());
  CHECK(fitted("", 5).empty());
}

TEST_CASE("lines break between words; a word that is too long is not broken") {
  const auto wrapped = [](const std::string& text, float letters) {
    return Wrapped(text, 10, letters * 6, WidthOf);
  };
  using Lines = std::vector<std::string>;
  CHECK(wrapped("a short one", 11) == Lines{"a short one"});
  CHECK(wrapped("a short one", 10) == Lines{"a short", "one"});
  CHECK(wrapped("a much-too-long word", 6) == Lines{"a", "much-too-long", "word"});
  CHECK(wrapped("", 5) == Lines{""});
}

TEST_CASE("an urgent line is shown in full, wrapped over several rows") {
  ViewScene scene;
  scene.state.cameras[0].status.state = lens::ZoomState::kStale;
  scene.state.cameras[0].status.reason = lens::ZoomReason::kTagsBad;
  const std::string reason(lens::ZoomReasonText(lens::ZoomReason::kTagsBad));
  const Drawn drawn(scene, {1280, 720});
  std::string column;
  for (const scene::DrawnText& text : drawn.list.texts) {
    if (text.y > drawn.layout.band.y && text.x < drawn.layout.band.width / 2)
      column += text.text + " ";
  }
  CAPTURE(column);
  CHECK(column.find("stale: " + reason) != std::string::npos);
  ViewScene full;
  MakeEverythingLong(full);
  CHECK(Drawn(full, {1280, 720}).Says("…"));  // a cut text is marked
}

TEST_CASE("without faults the strip says OK; tiles, details and messages are shown") {
  ViewScene scene;
  const Drawn drawn(scene, {1920, 1080});
  CHECK(drawn.Says("● OK"));
  for (const char* title : {"Camera", "Robot and model", "Messages"}) {
    CAPTURE(title);
    CHECK(drawn.Says(title));
  }
  CHECK(drawn.Says("valid: tags in place"));
  CHECK(drawn.Says("corrected"));
  CHECK(drawn.Says("4.15 mm"));
  CHECK(drawn.Says("±0.30 mm (95 %, measured)"));
  CHECK(drawn.Says("drift not monitored"));
  CHECK(drawn.Says("the zoom changed"));
  CHECK_FALSE(drawn.Says("Distances"));  // none is configured
  CHECK_FALSE(drawn.Says("STALE"));
  CHECK_FALSE(drawn.Says("exaggerated"));
}

TEST_CASE("stale data, alarms with their remedy, prompts and exaggeration are shown") {
  SECTION("lens, and the prompt of a calibration") {
    ViewScene scene;
    scene.state.cameras[0].status.state = lens::ZoomState::kCalibrating;
    scene.state.cameras[0].status.reason = lens::ZoomReason::kBoardStarted;
    scene.state.cameras[0].status.prompt = lens::BoardPrompt::kTiltLeft;
    scene.state.cameras[0].status.board_views = 7;
    const Drawn drawn(scene, {1280, 720});
    CHECK(drawn.Says("STALE: lens calibrating"));
    CHECK(drawn.Says("→ tilt the left edge towards the camera"));
  }
  SECTION("a calibration in progress: instruction, views and what is still uncertain") {
    ViewScene scene;
    cell::ViewCamera& camera = scene.state.cameras[0];
    camera.status.state = lens::ZoomState::kCalibrating;
    camera.status.prompt = lens::BoardPrompt::kUpperLeft;
    camera.guidance =
        lens::BoardGuidance{{{100, 100}, {500, 90}, {510, 400}, {95, 390}, {100, 100}},
                            {},
                            false,
                            4,
                            9,
                            2,
                            1,
                            {0.5F, 2}};
    const Drawn drawn(scene, {1920, 1080});
    CHECK(drawn.Says("↖ Move the board up and to the left"));
    CHECK(drawn.Says("of about 9"));
    CHECK(drawn.Says("50 % certain"));
    CHECK(drawn.Says("amber: not certain yet"));
    CHECK_FALSE(drawn.Says("4.15 mm"));
    CHECK_FALSE(drawn.Says("views recorded"));
    camera.guidance->uncertainty = {0.5F, 1};
    CHECK(Drawn(scene, {1920, 1080}).Says("further views confirm it"));
  }
  SECTION("no lens: tags may be in the image, but nothing is placed") {
    ViewScene scene;
    scene.state.cameras[0].status.state = lens::ZoomState::kStale;
    scene.state.cameras[0].status.reason = lens::ZoomReason::kNoLens;
    scene.state.cameras[0].lens.reset();
    const Drawn drawn(scene, {1280, 720});
    CHECK(drawn.Says("STALE: lens stale"));
    CHECK_FALSE(drawn.Says("not seen yet"));
  }
  SECTION("alarm") {
    ViewScene scene;
    scene.state.alarms = alarm::kRobotStale;
    scene.state.health = HealthOf({.alarms = alarm::kRobotStale});
    const Drawn drawn(scene, {1280, 720});
    CHECK(drawn.Says("■ ALARM"));
    CHECK(drawn.Says("robot input stale"));
    CHECK(drawn.Says("→ check the cable to the robot"));
    CHECK(drawn.Says("STALE: no current robot joint positions"));
  }
  SECTION("a point in a posture that is not the taught one") {
    ViewScene scene;
    CHECK_FALSE(Drawn(scene, {1920, 1080}).Says("not the taught posture"));
    scene.state.points[1].differs = true;
    CHECK(Drawn(scene, {1920, 1080}).Says("not the taught posture"));
  }
  SECTION("a silent daemon") {
    ViewScene scene("stress = true\n");
    CHECK(Drawn(scene, {1280, 720}).Says("stress, at most"));
    scene.state.now_s -= 10;
    const Drawn drawn(scene, {1280, 720});
    CHECK(drawn.Says("STALE: last data from plumblined 10 s ago"));
    CHECK(drawn.Says("○ NO DAEMON"));
    CHECK(drawn.Says("last data 10 s ago"));
    CHECK(drawn.Says("→ systemctl start plumbline"));
    const auto panels_say = [&](const std::string& words) {
      for (const Panel& panel : PanelsOf(drawn.facts)) {
        for (const PanelLine& line : panel.lines) {
          if (line.text.find(words) == std::string::npos) continue;
          CHECK(line.tone == Tone::kBad);
          return true;
        }
      }
      return false;
    };
    CHECK(panels_say("last robot reading 10 s ago"));
    CHECK(panels_say("no daemon"));
    for (const char* const claim : {"±0.30", "4.15", "valid: tags", "off nominal", "stress"}) {
      CAPTURE(claim);
      CHECK_FALSE(drawn.Says(claim));
    }
    CHECK(drawn.Says("not valid"));
  }
  SECTION("exaggeration, at every size") {
    for (const image::ImageSize size : {image::ImageSize{640, 480}, {1920, 1080}}) {
      ViewScene scene("exaggeration = 25.0\n");
      CHECK(Drawn(scene, size).Says("deflection exaggerated 25 times"));
      scene.state.cameras[0].status.state = lens::ZoomState::kMoving;
      CHECK(Drawn(scene, size).Says("deflection exaggerated 25 times"));
    }
  }
  SECTION("interference") {
    ViewScene scene;
    scene.state.health = HealthOf({.warnings = warning::kInterference});
    cell::ObjectTable table;
    table.objects.resize(2);
    table.pairs.push_back({0, 1, 0, 0});
    cell::SceneMeasurements measured;
    measured.time_s = ViewScene::kNow_s;
    cell::MeasuredPair pair{"gripper",         "car body", 1, 2, scene::Proximity::kInterference,
                            cell::Separation{}};
    pair.separation->touching = true;
    pair.separation->depth_m = 0.0021;
    measured.pairs.push_back(pair);
    const Drawn drawn(scene, {1920, 1080}, &table, &measured);
    CHECK(drawn.Says("■ gripper / car body:"));
    CHECK(drawn.Says("INTERFERENCE, 2.10 mm deep"));
    CHECK(drawn.Says("■ ALARM"));
    CHECK(drawn.Says("interference: gripper touches car body, 2.1 mm deep"));
    CHECK_FALSE(drawn.Says("OK"));
    // With little room a label is shortened, not cut: names and depth remain.
    measured.pairs.front().separation->p_b_W = scene.X_CW.Inverse() * Vec3(0, 0, 1.5);
    const Drawn small(scene, {640, 480}, &table, &measured);
    CHECK((small.Says("car body: INTERFERENCE 2.1 mm deep") ||
           small.Says("■ gripper / car body 2.1 mm deep")));
    measured.time_s -= 5;
    const Drawn old(scene, {1920, 1080}, &table, &measured);
    CHECK(old.Says("no current measurement"));
    CHECK_FALSE(old.Says("INTERFERENCE"));
  }
}

TEST_CASE("the picture states that there is no daemon") {
  ViewFacts facts;
  facts.link_problem = "/var/lib/plumbline/view.socket: No such file or directory";
  const PictureLayout layout = LayoutOf({1280, 720});
  const scene::DisplayList list = PictureWithoutState(facts, layout, WidthOf);
  CHECK(std::any_of(list.texts.begin(), list.texts.end(),
                    [](const scene::DrawnText& text) { return text.text == "○ NO DAEMON"; }));
}

TEST_CASE("two cameras each get a named part of the picture; panel lines name the camera") {
  ViewScene scene;
  scene.state.cameras.push_back(scene.state.cameras[0]);
  scene.state.cameras[0].status.name = status::CameraName::kSide;
  scene.state.cameras[1].status.name = status::CameraName::kRear;
  scene.state.cameras[1].status.state = lens::ZoomState::kStale;
  scene.state.cameras[1].status.reason = lens::ZoomReason::kZoomChanged;
  for (const image::ImageSize size : {image::ImageSize{640, 480}, {1280, 720}, {1920, 1080}}) {
    CAPTURE(size.width);
    const Drawn drawn(scene, size);
    ExpectTidy(drawn);
    REQUIRE(drawn.list.beside.size() == 1);
    REQUIRE(drawn.list.area);
    REQUIRE(drawn.list.beside[0].area);
    const scene::Area a = *drawn.list.area, b = *drawn.list.beside[0].area;
    const scene::Area& image = drawn.layout.image;
    for (const scene::Area& part : {a, b}) {
      CHECK(part.x >= image.x);
      CHECK(part.y >= image.y);
      CHECK(part.right() <= image.right() + 0.01F);
      CHECK(part.bottom() <= image.bottom() + 0.01F);
      CHECK(part.width == a.width);
      CHECK(part.width / part.height == Approx(16.0F / 9).epsilon(0.01));  // no bars
    }
    CHECK((b.x >= a.right() || b.y >= a.bottom()));
    CHECK(drawn.list.beside[0].size == size);
    CHECK(drawn.Says("side"));
    CHECK(drawn.Says("rear: stale"));
    // Only the stale camera is marked.
    int in_a = 0, in_b = 0;
    for (const scene::DrawnText& text : drawn.list.texts) {
      if (text.text.rfind("▲ STALE", 0) != 0 || text.y < image.y) continue;
      in_a += text.x >= a.x && text.x < a.right() && text.y > a.y && text.y <= a.bottom() ? 1 : 0;
      in_b += text.x >= b.x && text.x < b.right() && text.y > b.y && text.y <= b.bottom() ? 1 : 0;
    }
    CHECK(in_a == 0);
    CHECK(in_b == 1);
  }
}

TEST_CASE("two images are placed side by side or stacked, whichever shows them larger") {
  const scene::Area wide{0, 0, 1000, 300}, high{10, 20, 400, 600};
  const std::vector<scene::Area> beside = SplitArea(wide, 2, {1920, 1080}, 10);
  CHECK(beside[1].x == 505);
  CHECK(beside[1].width == 495);
  CHECK(beside[1].height == 300);
  const std::vector<scene::Area> below = SplitArea(high, 2, {1920, 1080}, 10);
  CHECK(below[1].y == 325);
  CHECK(below[1].height == 295);
  CHECK(below[1].width == 400);
  const std::vector<scene::Area> one = SplitArea(high, 1, {1920, 1080}, 10);
  CHECK(one[0].width == 400);
  CHECK(one[0].height == 600);
}

namespace {

/// Relative luminance of an opaque colour [WCAG 2.1].
double LuminanceOf(const scene::Colour& colour) {
  const auto linear = [](float value) {
    const auto v = static_cast<double>(value);
    return v <= 0.03928 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
  };
  return 0.2126 * linear(colour.r) + 0.7152 * linear(colour.g) + 0.0722 * linear(colour.b);
}

/// Colour below the middle of a text, over a white image in the worst case.
scene::Colour GroundOf(const scene::DisplayList& list, const scene::Area& text) {
  scene::Colour ground{1, 1, 1, 1};
  const float x = text.x + text.width / 2, y = text.y + text.height / 2;
  for (const scene::DrawnBox& box : list.boxes) {
    const bool below = x >= box.x && x < box.x + box.width && y >= box.y && y < box.y + box.height;
    if (!below) continue;
    const float a = box.colour.a;
    ground = {a * box.colour.r + (1 - a) * ground.r, a * box.colour.g + (1 - a) * ground.g,
              a * box.colour.b + (1 - a) * ground.b, 1};
  }
  return ground;
}

}  // namespace

TEST_CASE("every text has a contrast of at least 7 to 1, in every state") {
  for (const int state : {0, 1, 2, 3}) {
    ViewScene scene("exaggeration = 10.0\nstress = true\n");
    if (state == 1) scene.state.health = HealthOf({.weakest_basis = model::RadiusBasis::kAssumed});
    if (state == 2) scene.state.cameras[0].status.state = lens::ZoomState::kStale;
    if (state == 3) MakeEverythingLong(scene);
    const Drawn drawn(scene, {1920, 1080});
    for (const scene::DrawnText& text : drawn.list.texts) {
      const double ink = LuminanceOf(text.colour) + 0.05;
      const double ground = LuminanceOf(GroundOf(drawn.list, Of(text))) + 0.05;
      CAPTURE(state, text.text);
      CHECK(text.colour.a == 1);
      CHECK(std::max(ink, ground) / std::min(ink, ground) >= 7);
    }
  }
}

TEST_CASE("a detail that is too long is shortened before its value") {
  ViewScene scene;
  cell::ObjectTable table;
  table.objects.resize(2);
  table.pairs.push_back({0, 1, 0, 0});
  cell::SceneMeasurements measured;
  measured.time_s = ViewScene::kNow_s;
  cell::MeasuredPair pair{"a gripper with a long name", "a car body",      1, 2,
                          scene::Proximity::kApart,     cell::Separation{}};
  pair.separation->distance_m = 0.1234;
  measured.pairs.push_back(pair);
  CHECK(Drawn(scene, {1920, 1080}, &table, &measured).Says("…: 123.4 mm"));
}

TEST_CASE("each state class has a glyph of its own") {
  std::vector<std::string> glyphs;
  for (const StateClass state : {StateClass::kHealthy, StateClass::kAdvisory, StateClass::kWarning,
                                 StateClass::kAlarm, StateClass::kUnknown}) {
    glyphs.emplace_back(MarkOf(state).glyph);
  }
  std::sort(glyphs.begin(), glyphs.end());
  CHECK(std::adjacent_find(glyphs.begin(), glyphs.end()) == glyphs.end());
}

TEST_CASE("messages come newest first, and repeats are folded into the newest") {
  ViewScene scene;
  scene.state.lines.clear();
  for (std::uint64_t k = 1; k <= 9; ++k) {
    const std::string text =
        k % 3 == 0 ? "the zoom changed" : "frame " + std::to_string(k) + " lost";
    scene.state.lines.push_back({k, 1.8e9 + static_cast<double>(k), 4, text});
  }
  ViewFacts facts;
  facts.state = &scene.state;
  facts.viewer_lines = {{1, 1.8e9 + 20, 3, "gripper.stl: cannot be read"}};
  const std::vector<PanelLine> lines = RecentMessages(facts, 10);
  REQUIRE(lines.size() == 2);
  CHECK(lines[0].text == "08:00:09 (3 times) the zoom changed");
  CHECK(lines[1].text == "08:00:08 (6 times) frame 8 lost");
  CHECK(RecentMessages(facts, 1).size() == 1);
  // Other numbers are folded, points are not.
  scene.state.lines = {{1, 1.8e9, 6, "point 1 (left) corrected by 2.84 mm"},
                       {2, 1.8e9 + 1, 6, "point 2 (right) corrected by 2.84 mm"},
                       {3, 1.8e9 + 2, 6, "point 1 (left) corrected by 2.91 mm"}};
  const std::vector<PanelLine> points = RecentMessages(facts, 10);
  REQUIRE(points.size() == 2);
  CHECK(points[0].text == "08:00:02 (2 times) point 1 (left) corrected by 2.91 mm");
}

}  // namespace plumbline::screen_text_test
