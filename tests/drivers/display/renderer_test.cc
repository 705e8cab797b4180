#include "drivers/display/renderer.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <numbers>

#include "firmware-like/geometry/rotation.h"
#include "firmware-like/image/image_size.h"
#include "tests/drivers/display/drawing_fixture.h"

namespace plumbline::renderer_test {

using namespace plumbline::display;
using test::At;
using test::Pixel;

namespace {

const image::ImageSize kSize{640, 480};
const scene::Colour kRed{1, 0, 0, 1}, kGreen{0, 1, 0, 1};

/// Centroid of everything brighter than the empty picture in one channel; brightness is capped at
/// `most`.
lens::Vec2 Centroid(const RgbImage& image, int Pixel::*channel, int most) {
  double sum = 0, u_sum = 0, v_sum = 0;
  for (int v = 0; v < image.size.height; ++v) {
    for (int u = 0; u < image.size.width; ++u) {
      const double weight = std::clamp(At(image, u, v).*channel - 33, 0, most);
      sum += weight;
      u_sum += weight * u;
      v_sum += weight * v;
    }
  }
  return {u_sum / sum, v_sum / sum};
}

int Count(const RgbImage& image, const std::function<bool(const Pixel&)>& is) {
  int count = 0;
  for (int v = 0; v < image.size.height; ++v) {
    for (int u = 0; u < image.size.width; ++u) count += is(At(image, u, v)) ? 1 : 0;
  }
  return count;
}

bool Reddish(const Pixel& p) {
  return p.r > 100 && p.g < 60;
}
bool Greenish(const Pixel& p) {
  return p.g > 100 && p.r < 60;
}

RgbImage Drawn(test::Drawing& drawing, const scene::DisplayList& list) {
  REQUIRE(drawing.renderer->Draw(list) == DrawResult::kDrawn);
  return drawing.renderer->ReadBack();
}

}  // namespace

TEST_CASE("a mesh point is drawn where the pinhole projects it, to 0.05 px") {
  test::Drawing drawing;
  if (!drawing.renderer) return;
  scene::DisplayList list = test::EmptyList(kSize);
  list.pinhole.fx = 812.3;
  list.pinhole.fy = 807.1;
  list.pinhole.cx = 331.7;
  list.pinhole.cy = 227.4;
  const int square = drawing.renderer->LoadMesh(test::Square(0.1F)).value();
  double worst_px = 0;
  for (const Vec3& p_C : {Vec3(0, 0, 1.2), Vec3(0.31, -0.17, 1.5), Vec3(-0.4123, 0.2771, 1.4142),
                          Vec3(0.05, 0.33, 1.3)}) {
    list.meshes = {test::Placed(square, p_C, kRed)};
    // Rotated, so that its edges do not step by whole pixel rows.
    list.meshes[0].X_CF.R = RotationFromRollPitchYaw(Vec3(0, 0, 0.37));
    const lens::Vec2 seen = Centroid(Drawn(drawing, list), &Pixel::r, 1);
    worst_px = std::max(worst_px, (seen - Project(list.pinhole, p_C)).norm());
  }
  std::printf("a known point: worst %.4f px\n", worst_px);
  CHECK(worst_px < 0.05);
}

TEST_CASE("a point of the undistorted image coincides with the mesh on it") {
  test::Drawing drawing;
  if (!drawing.renderer) return;
  const Vec3 p_C(0.37, -0.24, 1.5);
  lens::Lens lens = test::Pinhole(560, kSize);
  lens.k1 = -0.25;
  lens.p1 = 0.002;
  const lens::Vec2 spot = Project(lens, p_C);  // in the camera image: a spot of 3 px
  std::vector<std::uint8_t> grey(640 * 480, 33);
  for (int v = 0; v < 480; ++v) {
    for (int u = 0; u < 640; ++u) {
      const double r2 = (lens::Vec2(u, v) - spot).squaredNorm();
      grey[static_cast<std::size_t>(v * 640 + u)] =
          static_cast<std::uint8_t>(std::lround(33 + 200 * std::exp(-r2 / 18)));
    }
  }
  scene::DisplayList list = test::EmptyList(kSize, 500);
  list.background.luma = {grey.data(), 640, 480, 640};
  list.background.lens = lens;
  CHECK((Centroid(Drawn(drawing, list), &Pixel::r, 255) - Project(list.pinhole, p_C)).norm() <
        0.05);
}

TEST_CASE("nearer meshes hide farther ones, and an invisible occluder hides, too") {
  test::Drawing drawing;
  if (!drawing.renderer) return;
  const int square = drawing.renderer->LoadMesh(test::Square(0.2F)).value();
  scene::DisplayList list = test::EmptyList(kSize);
  std::vector<std::uint8_t> grey(640 * 480, 77);
  list.background.luma = {grey.data(), 640, 480, 640};
  const scene::DrawnMesh near = test::Placed(square, Vec3(0.05, 0, 1), kRed);
  const scene::DrawnMesh far = test::Placed(square, Vec3(0, 0, 1.2), kGreen);
  for (const bool near_first : {true, false}) {
    list.meshes = near_first ? std::vector{near, far} : std::vector{far, near};
    const RgbImage image = Drawn(drawing, list);
    CHECK(Reddish(At(image, 345, 240)));
    CHECK(Greenish(At(image, 285, 240)));
    CHECK(At(image, 100, 100).r == 77);
    list.meshes[near_first ? 0 : 1].occludes = true;
    const RgbImage hidden = Drawn(drawing, list);
    CHECK(At(hidden, 345, 240) == Pixel{77, 77, 77});
    CHECK(Greenish(At(hidden, 285, 240)));
  }
}

TEST_CASE("a transparent mesh shows what is behind it, but not its own far side") {
  test::Drawing drawing;
  if (!drawing.renderer) return;
  const int square = drawing.renderer->LoadMesh(test::Square(0.2F)).value();
  scene::DisplayList list = test::EmptyList(kSize);
  list.meshes = {test::Placed(square, Vec3(0, 0, 1), {1, 0, 0, 0.5F}),
                 test::Placed(square, Vec3(0.05, 0, 1.2), kGreen)};
  const Pixel both = At(Drawn(drawing, list), 340, 240);
  CHECK(both.r > 90);
  CHECK(both.g > 90);
  CHECK(both.b < 40);
}

TEST_CASE("everything beyond the clip plane is cut, and its grid is drawn") {
  test::Drawing drawing;
  if (!drawing.renderer) return;
  const int square = drawing.renderer->LoadMesh(test::Square(0.4F)).value();
  scene::DisplayList list = test::EmptyList(kSize);
  list.meshes = {test::Placed(square, Vec3(0, 0, 1), kRed)};
  list.lines = {{.points_C = {{-0.4, 0.25, 0.9}, {0.4, 0.25, 0.9}}, .colour = kGreen}};
  list.clip = scene::ClipPlane{.normal_C = Vec3::UnitX(), .distance_m = 0.05, .grid = false};
  const RgbImage cut = Drawn(drawing, list);
  const double edge = list.pinhole.cx + 500 * 0.05;
  for (int u = 225; u < 415; ++u) {
    CAPTURE(u);
    CHECK(Reddish(At(cut, u, 240)) == (u < edge));
  }
  const int line_v = static_cast<int>(std::lround(239.5 + 500 * 0.25 / 0.9));
  CHECK(At(cut, 300, line_v).g > 150);
  CHECK(At(cut, 360, line_v).g < 60);

  // An oblique plane, 1.5 m away on the axis, with lines every 0.1 m.
  const Vec3 normal = Vec3(0, -0.6, 0.8);
  list.clip = scene::ClipPlane{.normal_C = normal, .distance_m = 1.2, .grid = true};
  list.lines.clear();
  list.meshes[0].X_CF.p = Vec3(0, 0.3, 1.4);
  const RgbImage grid = Drawn(drawing, list);
  const Vec3 foot = 1.2 * normal, down(0, 0.8, 0.6);
  for (const double first : {-0.3, 0.1, 0.4}) {
    const lens::Vec2 on = Project(list.pinhole, Vec3(foot + first * Vec3::UnitX() + 0.75 * down));
    const lens::Vec2 off =
        Project(list.pinhole, Vec3(foot + (first + 0.05) * Vec3::UnitX() + 0.75 * down));
    const auto brightness = [&](const lens::Vec2& at) {
      return At(grid, static_cast<int>(std::lround(at.x())), static_cast<int>(std::lround(at.y())))
          .b;
    };
    CAPTURE(first, on.transpose(), off.transpose());
    CHECK(brightness(on) > 70);
    CHECK(brightness(off) < 40);
  }
  const lens::Vec2 hidden = Project(list.pinhole, Vec3(foot + 0.1 * Vec3::UnitX() + 1.1 * down));
  CHECK(Reddish(At(grid, static_cast<int>(hidden.x()), static_cast<int>(hidden.y()))));
}

TEST_CASE("the ground grid lies behind everything, starts at its origin and fades with distance") {
  test::Drawing drawing;
  if (!drawing.renderer) return;
  const int square = drawing.renderer->LoadMesh(test::Square(0.2F)).value();
  scene::DisplayList list = test::EmptyList(kSize);
  scene::GroundGrid ground;
  ground.cell_m = 0.25;
  ground.X_CG.R = RotationFromRollPitchYaw(Vec3(-1.3, 0, 0.4));
  ground.X_CG.p = Vec3(0.05, 0.3, 1.5);
  list.ground = ground;
  list.meshes = {test::Placed(square, Vec3(0.05, 0.3, 1.8), kRed)};  // behind the plane
  const RgbImage image = Drawn(drawing, list);
  const auto at = [&](double x, double y) {
    const lens::Vec2 px = Project<double>(list.pinhole, ground.X_CG * Vec3(x, y, 0));
    return At(image, static_cast<int>(std::lround(px.x())), static_cast<int>(std::lround(px.y())));
  };
  const int ground_level = at(0.125, 0.125).b;
  for (const double cell : {-2.0, -1.0, 1.0}) {
    CAPTURE(cell);
    const int brighter = at(0.25 * cell, 0.08).b - ground_level;
    CHECK(brighter > 15);
    CHECK(brighter < 80);  // quiet
    CHECK(std::abs(at(0.25 * cell + 0.1, 0.08).b - ground_level) < 8);
  }
  const lens::Vec2 mesh = Project<double>(list.pinhole, list.meshes[0].X_CF.p);
  CHECK(Reddish(
      At(image, static_cast<int>(std::lround(mesh.x())), static_cast<int>(std::lround(mesh.y())))));
  // Towards the horizon the lines are closer than two pixels and are not drawn.
  list.meshes.clear();
  const RgbImage empty = Drawn(drawing, list);
  int seen = 0;
  for (double x = -200; x <= 200; x += 7.3) {
    const lens::Vec2 far = Project<double>(list.pinhole, ground.X_CG * Vec3(x, -300, 0));
    const int u = static_cast<int>(std::lround(far.x())),
              v = static_cast<int>(std::lround(far.y()));
    if (u < 2 || v < 2 || u > kSize.width - 3 || v > kSize.height - 3) continue;
    ++seen;
    CHECK(At(empty, u, v).b - ground_level < 8);
  }
  CHECK(seen > 5);
}

TEST_CASE("lines have width, dashes and depth") {
  test::Drawing drawing;
  if (!drawing.renderer) return;
  scene::DisplayList list = test::EmptyList(kSize);
  scene::DrawnLine line{
      .points_C = {{-0.3, 0.1, 1}, {0.3, 0.1, 1}}, .colour = kGreen, .width_px = 5};
  list.lines = {line};
  const RgbImage solid = Drawn(drawing, list);
  const double v = Project(list.pinhole, line.points_C[0]).y();
  double covered = 0, centre = 0;
  for (int row = 270; row < 310; ++row) {
    const double share = (At(solid, 320, row).g - 33) / 222.0;
    covered += share;
    centre += share * row;
  }
  CHECK(covered == Approx(5).margin(0.1));
  CHECK(centre / covered == Approx(v).margin(0.05));
  CHECK(At(solid, 320 + 158, static_cast<int>(v)).g < 40);

  list.lines[0].dashed = true;
  const int dashed = Count(Drawn(drawing, list), Greenish);
  CHECK(dashed == Approx(0.5 * Count(solid, Greenish)).epsilon(0.15));

  const int square = drawing.renderer->LoadMesh(test::Square(0.4F)).value();
  list.lines[0].dashed = false;
  list.meshes = {test::Placed(square, Vec3(0, 0, 0.9), kRed)};
  CHECK(Reddish(At(Drawn(drawing, list), 320, 289)));
  list.lines[0].always_in_front = true;
  CHECK(Greenish(At(Drawn(drawing, list), 320, 289)));
  list.lines[0].always_in_front = false;
  list.meshes[0].X_CF.p.z() = 1;  // in the surface
  CHECK(Greenish(At(Drawn(drawing, list), 320, 289)));
}

TEST_CASE("a line that starts behind the camera is clipped at the near plane") {
  test::Drawing drawing;
  if (!drawing.renderer) return;
  scene::DisplayList list = test::EmptyList(kSize);
  list.lines = {{.points_C = {{0.1, 0, -1}, {0, 0, 1}}, .colour = kGreen, .width_px = 3}};
  const RgbImage image = Drawn(drawing, list);
  CHECK(At(image, 330, 240).g > 150);  // its direction: x = (1 - z) / 20
  CHECK(At(image, 500, 240).g > 150);
  CHECK(At(image, 300, 240).g < 40);
}

TEST_CASE("stress is coloured by the scale, rigid surfaces keep their shade") {
  test::Drawing drawing;
  if (!drawing.renderer) return;
  scene::DisplayList list = test::EmptyList(kSize);
  list.bend.length_m = 0.4F;
  for (int i = 0; i < scene::kBendStations; ++i) {
    list.bend.stations[static_cast<std::size_t>(i)].stress_Pa =
        1e8F * (1 - static_cast<float>(i) / 32);
  }
  list.stress_full_Pa = 1e8;
  scene::DrawnMesh bar = test::Placed(
      drawing.renderer->LoadMesh(test::Bar(0.05, 0.4, 40, 48)).value(), Vec3(-0.2, 0, 1), kRed);
  bar.X_CF.R = RotationFromRollPitchYaw(Vec3(0, std::numbers::pi / 2, 0));  // its z along C's x
  bar.bends = bar.by_stress = true;
  list.meshes = {bar};
  const RgbImage image = Drawn(drawing, list);
  const Pixel root = At(image, 223, 240), tip = At(image, 410, 240);
  CHECK(root.r > 150);  // yellow
  CHECK(root.g > 150);
  CHECK(root.b < 120);
  CHECK(tip.b > tip.r);  // dark blue
  CHECK(tip.b > tip.g);
  int last = 256;
  for (int u = 225; u < 410; u += 5) {
    const Pixel p = At(image, u, 240);
    const int light = (54 * p.r + 183 * p.g + 19 * p.b) / 256;
    CAPTURE(u);
    CHECK(light < last);
    last = light;
  }
}

TEST_CASE("boxes cover their pixels and mix, text is drawn over them") {
  test::Drawing drawing;
  if (!drawing.renderer) return;
  scene::DisplayList list = test::EmptyList(kSize);
  list.boxes = {{.x = 100, .y = 50, .width = 200, .height = 40, .colour = {0, 0, 1, 1}},
                {.x = 150, .y = 50, .width = 10, .height = 10, .colour = {1, 1, 1, 0.5F}}};
  const RgbImage boxes = Drawn(drawing, list);
  CHECK(Count(boxes, [](const Pixel& p) { return p.b > 200; }) == 200 * 40);
  CHECK(At(boxes, 100, 50).b == 255);
  CHECK(At(boxes, 299, 89).b == 255);
  CHECK(At(boxes, 99, 50).b == 33);
  CHECK(At(boxes, 155, 55).r == Approx(128).margin(1));

  list.texts = {{.x = 110,
                 .y = 80,
                 .height_px = 24,
                 .colour = {1, 1, 1, 1},
                 .text = "Spalt 0,7 mm \xC2\xB1 5 \xC2\xB5m"}};
  const RgbImage text = Drawn(drawing, list);
  int left = 640, right = 0, top = 480, bottom = 0;
  for (int v = 0; v < 480; ++v) {
    for (int u = 0; u < 640; ++u) {
      if (At(text, u, v).g < 128 || (u >= 150 && u < 160 && v < 60)) continue;
      left = std::min(left, u);
      right = std::max(right, u);
      top = std::min(top, v);
      bottom = std::max(bottom, v);
    }
  }
  const float width = drawing.renderer->TextWidth(list.texts[0].text, 24);
  CHECK(drawing.renderer->TakeRemarks().empty());
  CHECK(left == Approx(111).margin(2));
  CHECK(right == Approx(110 + width).margin(3));
  CHECK(top > 58);
  CHECK(top < 66);
  CHECK(bottom > 79);  // the comma, p and the micro sign extend below the baseline
  CHECK(bottom < 88);
}

TEST_CASE("a stroke covers its width with smooth edges; a closed one can be filled") {
  test::Drawing drawing;
  if (!drawing.renderer) return;
  scene::DisplayList list = test::EmptyList(kSize);
  list.strokes = {
      {{{100, 50}, {300, 50}}, {1, 0, 0, 1}, 4, false},
      {{{400, 100}, {500, 100}, {500, 200}, {400, 200}, {400, 100}}, {0, 0, 1, 1}, 1, true}};
  const RgbImage image = Drawn(drawing, list);
  CHECK(At(image, 200, 48).r == 255);
  CHECK(At(image, 200, 51).r == 255);
  CHECK(At(image, 200, 45).r == 33);
  CHECK(At(image, 200, 54).r == 33);
  double width = 0;  // integrated coverage across the stroke
  for (int v = 40; v < 60; ++v) width += (At(image, 200, v).r - 33) / 222.0;
  CHECK(width == Approx(4).margin(0.2));
  CHECK(At(image, 450, 150).b == 255);
  CHECK(At(image, 403, 197).b == 255);
  CHECK(At(image, 395, 150).b == 33);
}

TEST_CASE("a missing font is reported once, and the rest is drawn") {
  test::Drawing drawing(RendererOptions{.font_paths = {"/nowhere/font.ttf", "/dev/null"}});
  if (!drawing.renderer) return;
  scene::DisplayList list = test::EmptyList(kSize);
  list.boxes = {{.x = 10, .y = 10, .width = 5, .height = 5, .colour = kRed}};
  list.texts = {{.x = 100, .y = 100, .text = "not to be seen"}};
  const RgbImage image = Drawn(drawing, list);
  CHECK(Count(image, Reddish) == 25);
  CHECK(Count(image, [](const Pixel& p) { return p.g > 60; }) == 0);
  const std::vector<std::string> remarks = drawing.renderer->TakeRemarks();
  REQUIRE(remarks.size() == 1);
  CHECK(remarks[0] ==
        "no font found among /nowhere/font.ttf, /dev/null. Text is not drawn. Install "
        "fonts-dejavu-core.");
  CHECK(drawing.renderer->TextWidth("any", 20) == 0);
  Drawn(drawing, list);
  CHECK(drawing.renderer->TakeRemarks().empty());
}

TEST_CASE("glyphs of many sizes make the atlas grow, and a full atlas is cleared") {
  test::Drawing drawing;
  if (!drawing.renderer) return;
  scene::DisplayList list = test::EmptyList(kSize);
  for (int size = 8; size < 200; size += 2) {
    list.texts = {{.x = 5,
                   .y = 300,
                   .height_px = static_cast<float>(size),
                   .colour = kGreen,
                   .text = "ABCDEFGHMNQRW@%&0123456789abdgmw"}};
    const int lit = Count(Drawn(drawing, list), [](const Pixel& p) { return p.g > 150; });
    CAPTURE(size);
    CHECK(lit > 0);
  }
  const RgbImage last = Drawn(drawing, list);
  test::Drawing fresh;
  CHECK(Drawn(fresh, list).rgb == last.rgb);
}

TEST_CASE("invalid lists are rejected or drawn without the invalid parts") {
  test::Drawing drawing;
  if (!drawing.renderer) return;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const image::ImageSize size :
       {image::ImageSize{0, 480}, image::ImageSize{640, -1}, image::ImageSize{100000, 10}}) {
    scene::DisplayList list = test::EmptyList(kSize);
    list.size = size;
    CHECK(drawing.renderer->Draw(list) == DrawResult::kRefused);
    CHECK_FALSE(drawing.renderer->problem().empty());
  }
  scene::DisplayList list = test::EmptyList(kSize);
  list.pinhole.fx = nan;
  CHECK(drawing.renderer->Draw(list) == DrawResult::kRefused);
  CHECK(drawing.renderer->problem() == "the focal length of the picture is not positive");

  list = test::EmptyList(kSize);
  const int square = drawing.renderer->LoadMesh(test::Square(0.2F)).value();
  list.meshes = {test::Placed(square, Vec3(nan, 0, 1), kRed), test::Placed(99, Vec3(0, 0, 1), kRed),
                 test::Placed(square, Vec3(0, 0, -1), kRed),
                 test::Placed(square, Vec3(0, 0, 1), kGreen)};
  list.lines = {{.points_C = {{nan, 0, 1}, {0, 0, 1}}}, {.points_C = {{0, 0, 1}}}, {}};
  list.texts = {{.x = std::numeric_limits<float>::infinity(), .y = 0, .text = "x"},
                {.x = 0, .y = 20, .text = "\xFF\xC0\x80\xED\xA0\x80\x01\n"}};
  list.clip = scene::ClipPlane{.normal_C = Vec3(nan, 0, 0), .distance_m = 0, .grid = true};
  Drawn(drawing, list);
  list.clip.reset();
  CHECK(Greenish(At(Drawn(drawing, list), 320, 240)));
  const auto remarks = drawing.renderer->TakeRemarks();
  REQUIRE(remarks.size() == 1);
  CHECK(remarks[0] == "mesh 99 is not loaded");

  CHECK_FALSE(drawing.renderer->LoadMesh({}).ok());
  CHECK_FALSE(
      drawing.renderer->LoadMesh({.vertices_O = {{0, 0, 0}}, .triangles = {{0, 0, 1}}}).ok());
  drawing.renderer->DropMesh(square);
  CHECK_FALSE(Greenish(At(Drawn(drawing, list), 320, 240)));
}

TEST_CASE("the picture size can change between pictures") {
  test::Drawing drawing;
  if (!drawing.renderer) return;
  const int square = drawing.renderer->LoadMesh(test::Square(0.2F)).value();
  for (const image::ImageSize size :
       {image::ImageSize{640, 480}, image::ImageSize{1920, 1080}, image::ImageSize{33, 17}}) {
    scene::DisplayList list = test::EmptyList(size);
    list.meshes = {test::Placed(square, Vec3(0, 0, 1), kGreen)};
    const RgbImage image = Drawn(drawing, list);
    CHECK(image.size == size);
    CHECK(Greenish(At(image, size.width / 2, size.height / 2)));
    const Pixel corner = At(image, 0, 0);
    CHECK(Greenish(corner) == (size.width < 50));
  }
}

TEST_CASE(
    "two cameras in one picture: each in its area, with its image, over nothing of the other") {
  test::Drawing drawing;
  if (!drawing.renderer) return;
  const std::vector<std::uint8_t> dark(std::size_t{64} * 48, 60), light(std::size_t{64} * 48, 180);
  const int square = drawing.renderer->LoadMesh(test::Square(4.0F)).value();
  const auto view_of = [&](const scene::Area& area, const std::vector<std::uint8_t>& luma) {
    scene::DisplayList view = test::EmptyList(kSize);
    view.area = area;
    view.background.luma = {luma.data(), 64, 48, 64};
    view.background.sequence = 7;  // same sequence in each view: their textures must stay separate
    return view;
  };
  scene::DisplayList list = view_of({0, 0, 300, 480}, dark);
  list.beside = {view_of({320, 100, 320, 300}, light)};
  // A line across the picture and a square that fills it, in the right view only.
  list.beside[0].lines = {
      {.points_C = {{-5, -0.1, 1}, {5, -0.1, 1}}, .colour = kGreen, .width_px = 5}};
  scene::DrawnMesh mesh;
  mesh.mesh = square;
  mesh.X_CF.p = Vec3(0, 2.2, 1);
  mesh.colour = kRed;
  list.beside[0].meshes = {mesh};
  for (int again = 0; again < 2; ++again) {
    const RgbImage picture = Drawn(drawing, list);
    CHECK(At(picture, 100, 240).r == 60);
    CHECK(At(picture, 299, 240).r == 60);
    CHECK(At(picture, 310, 240).g < 40);  // between them
    CHECK(At(picture, 400, 110).r == 180);
    CHECK(At(picture, 400, 90).r < 40);  // above the right one
    const int line_v = static_cast<int>(Project(list.pinhole, Vec3(0, -0.1, 1)).y());
    CHECK(Greenish(At(picture, 400, line_v)));
    CHECK_FALSE(Greenish(At(picture, 200, line_v)));
    CHECK(Reddish(At(picture, 400, 390)));
    CHECK_FALSE(Reddish(At(picture, 200, 390)));
    CHECK_FALSE(Reddish(At(picture, 400, 410)));
  }
  list.beside.clear();
  list.area.reset();
  const RgbImage alone = Drawn(drawing, list);
  CHECK(At(alone, 400, 240).r == 60);
}

}  // namespace plumbline::renderer_test
