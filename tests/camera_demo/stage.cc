// plumbline-camera-stage FOLDER: what the camera of `./dev demo camera` sees, drawn with exact
// optics through a zoom lens, a zoom sensor that speaks VISCA, and the person who follows the
// display while the lens is calibrated. Writes frames, tags, objects and one lens that was
// calibrated before.
#include <fmt/core.h>

#include <atomic>
#include <chrono>
#include <fstream>
#include <iostream>
#include <sstream>
#include <thread>

#include "app/vision/lens_store/lens_store.h"
#include "tests/app/cell/view_link/watched_display.h"
#include "tests/app/vision/camera/camera_scene.h"
#include "tests/drivers/zoom/fake_visca_camera.h"
#include "tests/virtual_cell/register_client.h"

namespace {

using namespace plumbline;

constexpr int kKnownZoom = 4000;
constexpr int kMostViews = 80;

renderer::Camera CameraAt(int zoom) {
  return renderer::ZoomLens(1700 + 0.1 * zoom);
}

/// The tag body of the cell in the measurement frame; the drawn gripper then is where the arm at
/// rest has its tip, within millimetres.
Pose CellInWorld() {
  return {RotationFromRollPitchYaw(Vec3(0.1, 0.2, 0.3)), Vec3(2.69, -0.13, 1.8)};
}

bool KeepLens(const std::string& state) {
  std::filesystem::create_directories(state);
  auto store = vision::LensStore::Open(state + "/lenses.sqlite");
  if (!store) return false;
  vision::LensEntry entry;
  entry.key = {"demo camera", "1920x1080", kKnownZoom, 0};
  entry.lens = test::LensOfCamera(CameraAt(kKnownZoom));
  entry.covariance.diagonal().head<8>() << 0.04, 0.04, 0.04, 0.04, 1e-9, 1e-9, 1e-12, 1e-12;
  entry.size = {1920, 1080};
  entry.board = "exact";
  entry.utc = "2026-01-01T00:00:00Z";
  return store.value().Append(entry).ok();
}

/// A square bar of 80 x 80 x 1200 mm in slices, so that it can bend.
void WriteTool(const std::string& file) {
  constexpr int kSlices = 24;
  std::ofstream out(file);
  for (int k = 0; k <= kSlices; ++k) {
    const int z = 1200 * k / kSlices;
    out << fmt::format("v -40 -40 {0}\nv 40 -40 {0}\nv 40 40 {0}\nv -40 40 {0}\n", z);
  }
  for (int k = 0; k < kSlices; ++k) {
    for (int side = 0; side < 4; ++side) {
      const int a = 4 * k + side + 1, b = 4 * k + (side + 1) % 4 + 1;
      out << fmt::format("f {} {} {} {}\n", a, b, b + 4, a + 4);
    }
  }
  const int end = 4 * kSlices;
  out << fmt::format("f 4 3 2 1\nf {} {} {} {}\n", end + 1, end + 2, end + 3, end + 4);
}

constexpr const char* kObjects = R"(schema = 1
[[object]]
number = 1
name = "tool"
file = "tool.obj"
unit = "mm"
on = { frame = "flange" }
bends = true
colour = [0.6, 0.75, 0.85, 0.8]
)";

class Stage {
 public:
  explicit Stage(const std::string& folder) : folder_(folder), image_(folder) { ShowCell(); }

  const std::string& sensor() const { return visca_.device(); }
  void ShowCell() {
    image_.Show(test::DrawCell(CameraAt(zoom_), test::CellInCamera(), test::GripperInCamera()));
  }
  /// Turns the zoom ring; the image follows.
  void Zoom(int counts) {
    moving_ = true;
    zoom_ = counts;
    ShowCell();
    std::this_thread::sleep_for(std::chrono::milliseconds(800));
    moving_ = false;
  }
  /// A person with the board, until the lens is valid. @return  views shown; -1: given up
  int FollowDisplay(const std::string& daemon) {
    virtual_cell::RegisterClient plc("plumblined", daemon, 1, 10);
    test::WatchedDisplay display(folder_ + "/state");
    test::GuidedPerson person(CameraAt(zoom_), {});
    while (plc.Read(500, 1).Word(0) != 4) {
      if (person.images() == kMostViews) return -1;
      const int kept = plc.Read(504, 1).Word(0);
      image_.Show(person.Next(display.Outline()));
      for (int wait = 0; wait < 60 && plc.Read(504, 1).Word(0) == kept; ++wait) {
        if (plc.Read(500, 1).Word(0) == 4) break;
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
      }
    }
    ShowCell();
    return static_cast<int>(person.images());
  }
  int zoom() const { return zoom_; }

 private:
  const std::string folder_;
  test::ShownImage image_;
  std::atomic<int> zoom_{kKnownZoom};
  std::atomic<bool> moving_{false};
  test::FakeViscaCamera visca_{
      test::CameraAnswers([this] { return test::BlockOf(zoom_, 0, false, moving_); })};
};

/// Commands on standard input: `zoom COUNTS`, `board HOST:PORT`, `truth`.
void Obey(Stage& stage) {
  std::string line;
  while (std::getline(std::cin, line)) {
    std::istringstream words(line);
    std::string command, argument;
    words >> command >> argument;
    if (command == "zoom") {
      stage.Zoom(std::stoi(argument));
      fmt::print("zoomed\n");
    } else if (command == "board") {
      fmt::print("board shown {} times\n", stage.FollowDisplay(argument));
    } else if (command == "truth") {
      const Vec3 tip_C = test::GripperInCamera() * test::GripperTip();
      const Vec3 tip_mm = 1e3 * (CellInWorld() * (test::CellInCamera().Inverse() * tip_C));
      fmt::print("truth {} {:.4f} {:.4f} {:.4f}\n", CameraAt(stage.zoom()).fx, tip_mm.x(),
                 tip_mm.y(), tip_mm.z());
    }
    std::fflush(stdout);
  }
}

}  // namespace

int main(int count, char** words) {
  if (count != 2) return 2;
  const std::string folder = words[1];
  try {
    std::filesystem::create_directories(folder);
    std::ofstream(folder + "/bodies.toml") << test::TagsText();
    std::ofstream(folder + "/objects.toml") << kObjects;
    WriteTool(folder + "/tool.obj");
    if (!KeepLens(folder + "/state")) throw std::runtime_error("the lens store");
    Stage stage(folder);
    fmt::print("zoom sensor at {}\n", stage.sensor());
    std::fflush(stdout);
    Obey(stage);
  } catch (const std::exception& error) {
    fmt::print(stderr, "plumbline-camera-stage: {}: {}\n", folder, error.what());
    return 1;
  }
  return 0;
}
