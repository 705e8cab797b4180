// Overlay display list, checked against projections that share no code with it.
#include "app/display/view/overlay.h"

#include <catch2/catch.hpp>

#include "firmware-like/image/image_size.h"
#include "tests/app/display/view/view_scene.h"
#include "tests/renderer/scene.h"

namespace plumbline::overlay_test {

using namespace plumbline::display;
using namespace plumbline::test;

namespace {

struct Composed {
  cell::Carriers carriers;
  ViewFacts facts;
  scene::DisplayList list;
  ImageMarks marks;
  PictureLayout layout;

  Composed(ViewScene& scene, image::ImageSize size, const cell::ObjectTable* table = nullptr,
           const cell::SceneMeasurements* measured = nullptr)
      : carriers(scene.Placed()), layout(LayoutOf(size)) {
    facts.state = &scene.state;
    facts.carriers = std::span(&carriers, 1);
    facts.model = &*scene.model;
    facts.table = table;
    facts.measured = measured;
    facts.now_s = ViewScene::kNow_s;
    const std::vector<int> meshes = {11, 12, 13};
    static const std::vector<std::uint8_t> pixels(std::size_t{1920} * 1080, 90);
    AddOverlay({facts, scene.model->config.overlay, meshes, {pixels.data()}}, 0, layout, list,
               marks);
  }
  bool Labelled(const std::string& text) const {
    return std::any_of(marks.labels.begin(), marks.labels.end(), [&](const Label& label) {
      return label.text.find(text) != std::string::npos;
    });
  }
};

cell::ObjectTable Table() {
  cell::ObjectTable table;
  cell::SceneObject tool;
  tool.name = "gripper";
  tool.on.kind = cell::Carrier::Kind::kFlange;
  tool.bends = true;
  tool.scale = 2;
  tool.X_KO = {RotationFromVector(Vec3(0.2, 0.1, 0)), Vec3(0.1, 0, 0.3)};
  cell::SceneObject body;
  body.name = "car body";
  body.on.kind = cell::Carrier::Kind::kWorld;
  body.occludes = true;
  cell::SceneObject hidden = body;
  hidden.name = "hidden";
  hidden.visible = false;
  table.objects = {tool, body, hidden};
  cell::SceneLine datum;
  datum.name = "datum";
  datum.on.kind = cell::Carrier::Kind::kBase;
  datum.points_K = {Vec3(2, 0, 1), Vec3(3, 0, 1)};
  table.lines = {datum};
  return table;
}

}  // namespace

TEST_CASE("a ground grid is drawn on the plane of the cell, only if configured") {
  ViewScene plain;
  CHECK_FALSE(Composed(plain, {1280, 720}).list.ground);
  ViewScene scene("grid_mm = 250\ngrid_z_mm = -40\n");
  const Composed composed(scene, {1280, 720});
  REQUIRE(composed.list.ground);
  CHECK(composed.list.ground->cell_m == Approx(0.25));
  CHECK((composed.list.ground->X_CG.p - scene.X_CW * Vec3(0, 0, -0.04)).norm() < 1e-9);
  CHECK(composed.list.ground->opacity == Approx(0.2F));
}

TEST_CASE("the picture's pinhole lens is the scaled camera lens: pixels keep their positions") {
  // An independent camera without distortion: the truth renderer's.
  const lens::Lens lens{1700, 1701, 955, 541, -0.08, 0.02, 1e-4, -2e-4, 0};
  renderer::Camera straight;
  straight.fx = lens.fx;
  straight.fy = lens.fy;
  straight.cx = lens.cx;
  straight.cy = lens.cy;
  for (const image::ImageSize size : {image::ImageSize{640, 480}, {1280, 720}, {1920, 1080}}) {
    const PictureLayout layout = LayoutOf(size);
    const lens::Lens pinhole = PinholeIn(layout.image, lens, {1920, 1080});
    CHECK(pinhole.k1 == 0);
    const double s = pinhole.fx / lens.fx;
    CHECK(s == Approx(std::min(static_cast<double>(layout.image.width) / 1920,
                               static_cast<double>(layout.image.height) / 1080)));
    const double left = pinhole.cx + 0.5 - s * (lens.cx + 0.5);
    const double upper = pinhole.cy + 0.5 - s * (lens.cy + 0.5);
    for (const Vec3& p : {Vec3(0.1, -0.2, 1.3), Vec3(-0.4, 0.3, 2.0)}) {
      const Eigen::Vector2d truth = renderer::PixelOf(straight, p);
      const lens::Vec2 pixel = Project<double>(pinhole, p);
      CHECK(pixel.x() + 0.5 == Approx(s * (truth.x() + 0.5) + left));
      CHECK(pixel.y() + 0.5 == Approx(s * (truth.y() + 0.5) + upper));
    }
    // The whole image lies in its area.
    CHECK(left >= static_cast<double>(layout.image.x) - 1e-6);
    CHECK(left + s * 1920 <= static_cast<double>(layout.image.right()) + 1e-3);
    CHECK(upper >= static_cast<double>(layout.image.y) - 1e-6);
    CHECK(upper + s * 1080 <= static_cast<double>(layout.image.bottom()) + 1e-3);
    // No bars beside it.
    CHECK(s * 1920 == Approx(static_cast<double>(layout.image.width)).margin(1));
    CHECK(s * 1080 == Approx(static_cast<double>(layout.image.height)).margin(1));
  }
}

TEST_CASE("objects are drawn on their carriers, bent if configured, and omitted if hidden") {
  ViewScene scene;
  const cell::ObjectTable table = Table();
  const Composed composed(scene, {1280, 720}, &table);
  REQUIRE(composed.list.meshes.size() == 2);
  const scene::DrawnMesh& tool = composed.list.meshes[0];
  CHECK(tool.mesh == 11);
  CHECK(tool.bends);
  CHECK(tool.scale == 2);
  CHECK(composed.list.meshes[1].mesh == 12);
  CHECK(composed.list.meshes[1].occludes);
  CHECK((composed.list.meshes[1].X_CF.p - scene.X_CW.p).norm() < 1e-9);
  // The sagged arm's flange.
  deflection::LoadedState loaded;
  REQUIRE(scene.model->arm.AtCommanded(scene.state.q, {40, scene.state.payload_cog_F}, {}, loaded));
  const Pose X_CF = scene.X_CW * scene.model->arm.X_WB() * loaded.posture.X_BF();
  CHECK((tool.X_CF.p - X_CF.p).norm() < 1e-5);
  CHECK((tool.X_CF.R - X_CF.R).norm() < 1e-5);
  CHECK(composed.list.bend.length_m > 0);
  CHECK(composed.Labelled("datum"));
  REQUIRE(composed.list.background.luma.data != nullptr);
  CHECK(composed.list.background.lens->k1 == -0.08);
}

TEST_CASE("the region where the lens is trusted is outlined, as far as it lies in the image") {
  ViewScene scene;
  const auto outlines = [&] {
    const Composed composed(scene, {1280, 720}, nullptr);
    std::vector<scene::DrawnLine> found;
    for (const scene::DrawnLine& line : composed.list.lines) {
      if (line.dashed && line.points_C.size() > 8) found.push_back(line);
    }
    return found;
  };
  CHECK(outlines().empty());
  scene.state.cameras[0].usable_radius_px = 700;
  const auto lines = outlines();
  REQUIRE(lines.size() >= 2);  // the circle leaves the image at its upper and lower edge
  for (const scene::DrawnLine& line : lines) {
    for (const Vec3& p_C : line.points_C) {
      const lens::Vec2 pixel = Project(*scene.state.cameras[0].lens, p_C);
      CHECK((pixel - lens::MiddleOf({1920, 1080})).norm() == Approx(700).margin(1e-3));
    }
  }
}

TEST_CASE("assembly points show the taught position, the uncorrected tip and the 95 % radius") {
  ViewScene scene("exaggeration = 20.0\n");
  const Composed composed(scene, {1280, 720});
  CHECK(composed.list.exaggeration == 20);
  const correction::AssemblyPoint& point = scene.model->config.machine.points[0];
  const Vec3 taught_C = scene.X_CW * point.X_WP.p;
  const Vec3 missed_C =
      scene.X_CW *
      Vec3(point.X_WP.p - 20 * (scene.model->arm.X_WB().R * scene.state.points[0].translation_B));
  const auto any_line = [&](const auto& holds) {
    return std::any_of(composed.list.lines.begin(), composed.list.lines.end(), holds);
  };
  CHECK(any_line([&](const scene::DrawnLine& one) {
    return one.points_C.size() == 2 && (one.points_C[0] - taught_C).norm() < 1e-9 &&
           (one.points_C[1] - missed_C).norm() < 1e-9;
  }));
  CHECK(any_line([&](const scene::DrawnLine& one) {
    return one.points_C.size() > 8 &&
           std::abs((one.points_C[3] - taught_C).norm() - 20 * 0.0003) < 1e-9;
  }));
  CHECK(composed.Labelled("assembly 1"));
  // Taught and uncorrected position are kept clear.
  for (const Vec3& p_C : {taught_C, missed_C}) {
    const lens::Vec2 pixel = Project<double>(composed.list.pinhole, p_C);
    CHECK(std::any_of(composed.marks.keep_clear.begin(), composed.marks.keep_clear.end(),
                      [&](const scene::Area& area) {
                        return area.x < static_cast<float>(pixel.x()) &&
                               area.right() > static_cast<float>(pixel.x()) &&
                               area.y < static_cast<float>(pixel.y()) &&
                               area.bottom() > static_cast<float>(pixel.y());
                      }));
  }
}

TEST_CASE("a point without a valid correction is labelled so") {
  ViewScene scene;
  scene.state.points[1].valid = false;
  scene.state.points[1].code = correction::CorrectionCode::kUnreachable;
  const Composed composed(scene, {1280, 720});
  CHECK(composed.Labelled("assembly 2: no correction"));
}

TEST_CASE("stale objects are grey; objects without a pose are not drawn") {
  ViewScene scene;
  const cell::ObjectTable table = Table();
  const scene::Colour grey = Greyed({1, 1, 1, 1});
  SECTION("lens") {
    scene.state.cameras[0].status.state = lens::ZoomState::kVerifying;
    const Composed composed(scene, {1280, 720}, &table);
    for (const scene::DrawnMesh& mesh : composed.list.meshes) CHECK(mesh.colour.r == grey.r);
    for (const scene::DrawnLine& line : composed.list.lines) CHECK(line.colour.r == grey.r);
    CHECK_FALSE(StaleReasons(composed.facts).empty());
  }
  SECTION("robot: the tool alone") {
    scene.state.alarms = alarm::kRobotStale;
    const Composed composed(scene, {1280, 720}, &table);
    CHECK(composed.list.meshes[0].colour.r == grey.r);
    CHECK(composed.list.meshes[1].colour.r == Approx(0.6));
  }
  SECTION("no lens") {
    scene.state.cameras[0].lens.reset();
    const Composed composed(scene, {1280, 720}, &table);
    CHECK(composed.list.meshes.empty());
    CHECK(composed.list.lines.empty());
    CHECK(composed.list.background.luma.data != nullptr);
  }
  SECTION("nothing wrong") {
    const Composed composed(scene, {1280, 720}, &table);
    CHECK(StaleReasons(composed.facts).empty());
  }
}

TEST_CASE("the unloaded tool is drawn behind the loaded one or beside it") {
  const cell::ObjectTable table = Table();
  ViewScene behind("nominal = \"behind\"\n"), beside("nominal = \"beside\"\n");
  const Composed first(behind, {1280, 720}, &table), second(beside, {1280, 720}, &table);
  REQUIRE(first.list.meshes.size() == 3);
  CHECK_FALSE(first.list.meshes[1].bends);
  CHECK(first.list.meshes[1].colour.a < first.list.meshes[0].colour.a);
  CHECK((first.list.meshes[1].X_CF.p - first.list.meshes[0].X_CF.p).norm() < 0.05);
  const lens::Vec2 loaded = Project<double>(second.list.pinhole, second.list.meshes[0].X_CF.p);
  const lens::Vec2 nominal = Project<double>(second.list.pinhole, second.list.meshes[1].X_CF.p);
  CHECK(loaded.x() - nominal.x() > 0.15 * static_cast<double>(second.layout.image.width));
  CHECK(second.Labelled("without load"));
  CHECK(second.Labelled("loaded"));
}

TEST_CASE("a clip plane follows its carrier") {
  ViewScene scene;
  cell::ObjectTable table = Table();
  table.clip = cell::SceneClip{{cell::Carrier::Kind::kWorld, "", 0}, Vec3(0, 0, 1), 0.9, true};
  const Composed composed(scene, {1280, 720}, &table);
  REQUIRE(composed.list.clip);
  const Vec3 on_it = scene.X_CW * Vec3(3, -2, 0.9);
  CHECK(composed.list.clip->normal_C.dot(on_it) == Approx(composed.list.clip->distance_m));
}

TEST_CASE("interference is labelled at its location; outdated results are not drawn") {
  ViewScene scene;
  cell::SceneMeasurements measured;
  measured.time_s = ViewScene::kNow_s - 0.1;
  cell::MeasuredPair pair{"gripper",         "car body", 1, 2, scene::Proximity::kInterference,
                          cell::Separation{}};
  pair.separation->touching = true;
  pair.separation->depth_m = 0.0042;
  pair.separation->p_a_W = pair.separation->p_b_W = scene.X_CW.Inverse() * Vec3(0, 0, 1.5);
  measured.pairs.push_back(pair);
  CHECK(Composed(scene, {1280, 720}, nullptr, &measured)
            .Labelled("gripper / car body: INTERFERENCE 4.2 mm deep"));
  measured.time_s -= 2;
  CHECK_FALSE(Composed(scene, {1280, 720}, nullptr, &measured).Labelled("INTERFERENCE"));
}

}  // namespace plumbline::overlay_test
