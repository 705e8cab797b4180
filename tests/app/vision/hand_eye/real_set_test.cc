// A real robot that carries a ChArUco board in front of a fixed camera: corners from
// github.com/Jmeyer1292/robot_cal_tools (Apache-2.0). Skipped without the folder of measured data.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "app/vision/hand_eye/hand_eye.h"
#include "firmware-like/geometry/rotation.h"

namespace plumbline::real_set_test {

using namespace plumbline::vision;
namespace fs = std::filesystem;

namespace {

fs::path Folder() {
  const char* folder = std::getenv("PLUMBLINE_MEASURED");
  return fs::path(folder != nullptr ? folder : "../shared/measured") / "robot-charuco-rct";
}

/// Parses "x: 0.1" lines.
std::map<std::string, double> Numbers(const fs::path& file) {
  std::ifstream stream(file);
  std::map<std::string, double> numbers;
  for (std::string line; std::getline(stream, line);) {
    const auto colon = line.find(':');
    std::istringstream value(colon == std::string::npos ? "" : line.substr(colon + 1));
    double number = 0;
    if (value >> number)
      numbers[line.substr(line.find_first_not_of(' '), colon - line.find_first_not_of(' '))] =
          number;
  }
  return numbers;
}

std::vector<HandEyeView> Views() {
  std::ifstream stream(Folder() / "corners_opencv46.csv");
  std::map<int, HandEyeView> views;
  std::string line;
  std::getline(stream, line);
  while (std::getline(stream, line)) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream fields(line);
    int image = 0, corner = 0;
    double x = 0, y = 0, u = 0, v = 0;
    fields >> image >> corner >> x >> y >> u >> v;
    HandEyeView& view = views[image];
    view.points_K.emplace_back(x, y, 0);
    view.pixels.emplace_back(u, v);
  }
  std::vector<HandEyeView> list;
  for (auto& [image, view] : views) {
    auto pose = Numbers(Folder() / "poses" / (std::to_string(image) + ".yaml"));
    view.name = std::to_string(image) + ".png";
    view.X_BF.p = Vec3(pose["x"], pose["y"], pose["z"]);
    view.X_BF.R =
        Eigen::Quaterniond(pose["qw"], pose["qx"], pose["qy"], pose["qz"]).normalized().matrix();
    list.push_back(view);
  }
  return list;
}

}  // namespace

TEST_CASE("a real robot and camera: with the published lens, and with the lens estimated",
          "[measured]") {
  if (!fs::exists(Folder())) {
    WARN("SKIPPED: no " << Folder() << " (set PLUMBLINE_MEASURED)");
    return;
  }
  const std::vector<HandEyeView> views = Views();
  REQUIRE(views.size() == 14);
  lens::KnownLens lens;
  lens.lens.fx = 1352.027;
  lens.lens.fy = 1356.143;
  lens.lens.cx = 789.671;
  lens.lens.cy = 627.300;
  HandEyeOptions options;
  options.image = {1600, 1200};
  options.acceptable_m = 3e-3;
  const HandEye published = CalibrateHandEye(views, lens, options);
  options.free_lens = options.free_size = true;
  const HandEye adjusted = CalibrateHandEye(views, lens, options);
  // The published lens has no distortion, but the real one has.
  CHECK_FALSE(published.accepted);
  CHECK(std::any_of(published.reasons.begin(), published.reasons.end(), [](const auto& reason) {
    return reason.find("contradict the lens") != std::string::npos;
  }));
  CAPTURE(adjusted.reasons, adjusted.linear.rms_px, adjusted.linear.position_m,
          adjusted.adjusted.rms_px, adjusted.adjusted.position_m, adjusted.sigma_px,
          adjusted.robot_m, adjusted.size_ratio, adjusted.size_ratio_sd, adjusted.point_sd_m);
  CHECK(adjusted.accepted);
  CHECK(adjusted.used.size() == 14);
  CHECK(adjusted.adjusted.rms_px < 1.6);
  CHECK(adjusted.adjusted.position_m < 1e-3);
  CHECK(adjusted.adjusted.position_m < 0.2 * adjusted.linear.position_m);
  CHECK(std::abs(adjusted.lens.lens.fx / lens.lens.fx - 1) < 0.01);
  CHECK(std::abs(adjusted.lens.lens.k1 + 0.118) < 0.03);  // as others fitted it
  // The data set's own initial guess of the camera pose.
  CHECK(adjusted.camera.X.p.x() == Approx(-0.0196).margin(0.02));
  CHECK(adjusted.camera.X.p.y() == Approx(1.2784).margin(0.02));
  CHECK(adjusted.camera.X.p.z() == Approx(0.2840).margin(0.02));
}

}  // namespace plumbline::real_set_test
