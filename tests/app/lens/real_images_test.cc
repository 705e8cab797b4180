// Real images against what is published of their lenses.
#include <catch2/catch.hpp>
#include <cstdlib>
#include <filesystem>
#include <iostream>

#include "app/lens/board_detection.h"
#include "app/lens/calibration.h"
#include "drivers/camera/image_folder.h"

namespace plumbline {
namespace {

namespace fs = std::filesystem;

/// The folder of the recordings; empty, and told, where they are not.
fs::path Chessboards() {
  const char* given = std::getenv("PLUMBLINE_MEASURED");
  const fs::path folder =
      fs::path(given != nullptr ? given : "../shared/measured") / "camera-chessboards";
  if (fs::exists(folder)) return folder;
  WARN("SKIPPED: no folder " << folder.string() << "; set PLUMBLINE_MEASURED");
  std::cout << "SKIPPED: no measured chessboards\n";
  return {};
}

}  // namespace

TEST_CASE("OpenCV's two sample cameras: every board found, focal lengths as published",
          "[measured]") {
  const fs::path folder = Chessboards();
  if (folder.empty()) return;
  const Board board{9, 6, 0.025};
  struct Camera {
    const char* name;
    double f_px, cx_px, cy_px;  // published for the left one; OpenCV 4.6 on all views for the right
  };
  for (const Camera& camera :
       {Camera{"left", 535.916, 342.283, 235.571}, Camera{"right", 542.34, 328.33, 246.95}}) {
    std::vector<BoardView> views;
    const auto names = ImageNames((folder / "opencv-left-right").string());
    REQUIRE(names);
    for (const std::string& name : *names) {
      if (name.rfind(camera.name, 0) != 0) continue;
      const auto image = ReadImage((folder / "opencv-left-right" / name).string());
      REQUIRE(image);
      const auto view = DetectBoard(image->View(), board);
      INFO(name << ": " << (view ? "" : view.error()));
      REQUIRE(view);
      views.push_back(*view);
      views.back().name = name;
      views.back().time_s = static_cast<double>(views.size());
    }
    CHECK(views.size() == 13);
    const LensCalibration c = CalibrateLens(board, views, {640, 480});
    INFO(camera.name);
    // OpenCV's corners leave 0.41 and 0.46 px a point.
    CHECK(c.rms_px < 0.25);
    CHECK(c.lens.fx == Approx(camera.f_px).epsilon(0.01));
    CHECK(c.lens.cx == Approx(camera.cx_px).margin(4));
    CHECK(c.lens.cy == Approx(camera.cy_px).margin(4));
  }
}

}  // namespace plumbline
