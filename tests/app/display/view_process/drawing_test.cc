// Drawing with GPU resets and without a GPU.
#include "app/display/view_process/drawing.h"

#include <catch2/catch.hpp>
#include <filesystem>
#include <iterator>

#include "tests/app/cell/scene/shapes.h"
#include "tests/drivers/display/drawing_fixture.h"
#include "tests/drivers/display/exchanged_egl.h"

namespace plumbline::drawing_test {

using namespace plumbline::display;

namespace {

std::ptrdiff_t Descriptors() {
  return std::distance(std::filesystem::directory_iterator("/proc/self/fd"), {});
}

std::shared_ptr<const cell::SceneSnapshot> SceneOfABox() {
  auto scene = std::make_shared<cell::SceneSnapshot>();
  scene->version = 1;
  auto checked = scene::CheckMesh(test::Cuboid({1, 1, 1}), 1);
  REQUIRE(checked);
  scene->meshes = {std::make_shared<const scene::CheckedMesh>(std::move(checked).value())};
  return scene;
}

/// The box fills the picture with its colour.
int RedIn(plumbline::display::Drawing& drawing, int mesh) {
  scene::DisplayList list = test::EmptyList({64, 48}, 40);
  scene::DrawnMesh box;
  box.mesh = mesh;
  box.X_CF.p = Vec3(0, 0, 1.2);
  box.colour = {1, 0, 0, 1};
  list.meshes = {box};
  if (!drawing.Draw(list)) return -1;
  const display::RgbImage image = drawing.renderer().ReadBack();
  return test::At(image, 32, 24).r;
}

}  // namespace

TEST_CASE("a hundred GPU resets are each logged and recovered from, without leaking descriptors") {
  if (const auto context = display::GlContext::Create();
      !context || !(*context)->reports_resets()) {
    std::puts("SKIPPED: no EGL here, or its driver reports no resets");
    return;
  }
  std::vector<std::string> logged;
  plumbline::display::Drawing drawing(
      [&](const plumbline::log::LogEntry& entry) { logged.push_back(entry.text); });
  const auto scene = SceneOfABox();
  double now_s = 0;
  std::ptrdiff_t before = 0;
  for (int resets = 0; resets < 100; ++resets) {
    REQUIRE(drawing.Ready(now_s));  // at once, without the retry pause of a missing GPU
    const std::vector<int> meshes = drawing.Meshes(scene);
    REQUIRE(meshes.size() == 1);
    REQUIRE(RedIn(drawing, meshes[0]) > 100);
    if (resets == 5) before = Descriptors();
    logged.clear();
    test::reset_status = test::kGuiltyContextReset;
    CHECK(RedIn(drawing, meshes[0]) == -1);
    REQUIRE(logged.size() == 1);
    CHECK_THAT(logged[0], Catch::Contains("was reset"));
    now_s += 0.03;
  }
  CHECK(Descriptors() == before);
}

TEST_CASE("a missing GPU is logged once and retried until drawing works") {
  std::vector<std::string> logged;
  plumbline::display::Drawing drawing(
      [&](const plumbline::log::LogEntry& entry) { logged.push_back(entry.text); });
  test::no_platforms = true;
  for (double now_s = 0; now_s < 1000; now_s += 0.5) {
    CHECK_FALSE(drawing.Ready(now_s));
    CHECK_FALSE(drawing.Draw(test::EmptyList({64, 48})));
  }
  test::no_platforms = false;
  REQUIRE(logged.size() == 1);
  CHECK_THAT(logged[0], Catch::Contains("cannot draw") && Catch::Contains("libgl1-mesa-dri"));
  if (!display::GlContext::Create()) {
    std::puts("SKIPPED: no EGL here");
    return;
  }
  CHECK(drawing.Ready(2000));
  CHECK(drawing.Draw(test::EmptyList({64, 48})));
  CHECK_THAT(logged.back(), Catch::Contains("drawing with"));
}

}  // namespace plumbline::drawing_test
