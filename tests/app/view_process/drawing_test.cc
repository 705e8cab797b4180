// The drawing process through what happens to a GPU: resets, and none at all.
#include "app/view_process/drawing.h"

#include <catch2/catch.hpp>
#include <filesystem>
#include <iterator>

#include "tests/app/scene/shapes.h"
#include "tests/drivers/display/drawing.h"
#include "tests/drivers/display/exchanged_egl.h"

using namespace plumbline;

namespace {

std::ptrdiff_t Descriptors() {
  return std::distance(std::filesystem::directory_iterator("/proc/self/fd"), {});
}

std::shared_ptr<const SceneNow> SceneOfABox() {
  auto scene = std::make_shared<SceneNow>();
  scene->version = 1;
  auto checked = CheckMesh(test::Cuboid({1, 1, 1}), 1);
  REQUIRE(checked);
  scene->meshes = {std::make_shared<const CheckedMesh>(std::move(checked).value())};
  return scene;
}

/// The box fills the picture with its colour.
int RedIn(plumbline::Drawing& drawing, int mesh) {
  DisplayList list = test::EmptyList({64, 48}, 40);
  DrawnMesh box;
  box.mesh = mesh;
  box.X_CF.p = Vec3(0, 0, 1.2);
  box.colour = {1, 0, 0, 1};
  list.meshes = {box};
  if (!drawing.Draw(list)) return -1;
  const RgbImage image = drawing.renderer().ReadBack();
  return test::At(image, 32, 24).r;
}

}  // namespace

TEST_CASE(
    "a GPU that is reset a hundred times: told each time, drawn again, nothing is left over") {
  if (const auto context = GlContext::Create(); !context || !(*context)->tells_resets()) {
    std::puts("SKIPPED: no EGL here, or its driver tells no resets");
    return;
  }
  std::vector<std::string> told;
  plumbline::Drawing drawing([&](const plumbline::LogEntry& entry) { told.push_back(entry.text); });
  const auto scene = SceneOfABox();
  double now_s = 0;
  std::ptrdiff_t before = 0;
  for (int resets = 0; resets < 100; ++resets) {
    REQUIRE(drawing.Ready(now_s));  // at once, without the pause of a computer that has no GPU
    const std::vector<int> meshes = drawing.Meshes(scene);
    REQUIRE(meshes.size() == 1);
    REQUIRE(RedIn(drawing, meshes[0]) > 100);
    if (resets == 5) before = Descriptors();
    told.clear();
    test::reset_status = test::kGuiltyContextReset;
    CHECK(RedIn(drawing, meshes[0]) == -1);
    REQUIRE(told.size() == 1);
    CHECK_THAT(told[0], Catch::Contains("was reset"));
    now_s += 0.03;
  }
  CHECK(Descriptors() == before);
}

TEST_CASE("no GPU and no EGL: told once, tried again seldom, and drawn once there is one") {
  std::vector<std::string> told;
  plumbline::Drawing drawing([&](const plumbline::LogEntry& entry) { told.push_back(entry.text); });
  test::no_platforms = true;
  for (double now_s = 0; now_s < 1000; now_s += 0.5) {
    CHECK_FALSE(drawing.Ready(now_s));
    CHECK_FALSE(drawing.Draw(test::EmptyList({64, 48})));
  }
  test::no_platforms = false;
  REQUIRE(told.size() == 1);
  CHECK_THAT(told[0],
             Catch::Contains("nothing can be drawn") && Catch::Contains("libgl1-mesa-dri"));
  if (!GlContext::Create()) {
    std::puts("SKIPPED: no EGL here");
    return;
  }
  CHECK(drawing.Ready(2000));
  CHECK(drawing.Draw(test::EmptyList({64, 48})));
  CHECK_THAT(told.back(), Catch::Contains("drawing by"));
}
