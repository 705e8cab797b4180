// plumbline-rig-scene FOLDER: what the virtual industrial PC's camera sees, drawn with exact
// optics, and what was calibrated before: image.grey, bodies.toml, lenses.sqlite.
#include <fmt/core.h>

#include <fstream>

#include "app/vision/lens_store/lens_store.h"
#include "tests/app/vision/camera/camera_scene.h"

namespace {

using namespace plumbline;

/// Zooms of lenses that the store holds: the USB camera's, and 0 where a sensor tells motion only.
constexpr int kZooms[] = {0, 4000};

renderer::Camera SmallCamera() {
  return renderer::Pinhole(640, 480, 900);
}

bool KeepLenses(const std::string& file) {
  auto store = vision::LensStore::Open(file);
  if (!store) return false;
  for (const int zoom : kZooms) {
    vision::LensEntry entry;
    entry.key = {"RIG0001", "GREY 640x480@2", zoom, 0};
    entry.lens = test::LensOfCamera(SmallCamera());
    entry.covariance.diagonal().head<9>() << 0.04, 0.04, 0.04, 0.04, 1e-9, 1e-9, 1e-12, 1e-12, 0;
    entry.size = {640, 480};
    entry.board = "none";
    entry.utc = "2026-01-01T00:00:00Z";
    if (!store.value().Append(entry)) return false;
  }
  return true;
}

}  // namespace

int main(int count, char** words) {
  if (count != 2) return 2;
  const std::string folder = words[1];
  const auto image = test::DrawCell(SmallCamera(), test::CellInCamera(), test::GripperInCamera());
  std::ofstream grey(folder + "/image.grey", std::ios::binary);
  for (const std::uint8_t level : image.grey) grey.put(static_cast<char>(level));
  std::ofstream bodies(folder + "/bodies.toml");
  bodies << test::TagsText();
  const bool kept = KeepLenses(folder + "/lenses.sqlite");
  if (!grey.flush() || !bodies.flush() || !kept) {
    fmt::print(stderr, "plumbline-rig-scene: {} cannot be written\n", folder);
    return 1;
  }
  return 0;
}
