// Scene of the daemon's camera tests: zooms, known lenses, a robot at standstill.
#pragma once

#include <catch2/catch.hpp>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "app/cell/journal/journal.h"
#include "app/vision/lens_store/lens_store.h"
#include "tests/app/temporary_folder.h"
#include "tests/app/vision/camera/camera_scene.h"
#include "tests/virtual_cell/register_client.h"
#include "tests/virtual_cell/running_cell.h"

namespace plumbline::test {

inline constexpr int kKnown = 4000, kOtherKnown = 6000, kNever = 9000;
/// The drawn tool then is where the arm at rest has its tip, within millimetres.
inline const Pose kCellInW{RotationFromRollPitchYaw(Vec3(0.1, 0.2, 0.3)), Vec3(2.69, -0.13, 1.8)};

inline renderer::Camera CameraAt(int zoom) {
  return renderer::ZoomLens(zoom == kKnown ? 2600 : zoom == kOtherKnown ? 3000 : 2200);
}

inline virtual_cell::VirtualCellOptions Idle() {
  virtual_cell::VirtualCellOptions options;
  options.profile = virtual_cell::Profile::kUr;
  options.idle = true;
  options.time_scale = 4;
  return options;
}

/// What was journaled under a folder with the demo's state directory.
inline std::vector<cell::JournalRow> JournalOf(const TemporaryFolder& folder) {
  auto journal = cell::Journal::OpenForReading(folder.path() + "/state/journal.sqlite");
  return journal.value().Read({}, std::vector<model::Joint>(6)).value();
}

/// A PLC's command to the daemon, and its answer's code.
inline int Command(virtual_cell::RegisterClient& plc, std::uint16_t sequence, int code,
                   int camera = 0) {
  std::vector<std::uint16_t> words(40);
  words[0] = static_cast<std::uint16_t>(code);
  words[16] = static_cast<std::uint16_t>(camera);
  words[39] = sequence;
  plc.Write(1000, words);
  REQUIRE(virtual_cell::Eventually([&] { return plc.Read(100, 40).Word(1) == sequence; }));
  return plc.Read(100, 40).Word(2);
}

/// Adds two lenses of a camera to the store.
/// @param usable_radius_px  of the second one
inline void KeepLenses(const std::string& state, const std::string& serial,
                       double usable_radius_px = std::numeric_limits<double>::infinity()) {
  std::filesystem::create_directories(state);
  auto store = vision::LensStore::Open(state + "/lenses.sqlite");
  REQUIRE(store);
  for (const int zoom : {kKnown, kOtherKnown}) {
    vision::LensEntry entry;
    entry.key = {serial, "test mode", zoom, 0};
    entry.lens = test::LensOfCamera(CameraAt(zoom));
    entry.covariance.diagonal().head<9>() << 0.04, 0.04, 0.04, 0.04, 1e-9, 1e-9, 1e-12, 1e-12, 0;
    entry.size = {1920, 1080};
    entry.board = "none";
    if (zoom == kOtherKnown) entry.usable_radius_px = usable_radius_px;
    entry.utc = "2026-01-01T00:00:00Z";
    REQUIRE(store.value().Append(entry));
  }
}

/// [tags] of that cell. @param file  that TagsText() was written to
inline std::string TagsTable(const std::string& file) {
  return "[tags]\nfile = \"" + file +
         "\"\ntool = \"gripper\"\n"
         "tip_mm = [150.0, 20.0, 10.0]\ncell_xyz_mm = [2690.0, -130.0, 1800.0]\n"
         "cell_rpy_deg = [5.729577951308232, 11.459155902616464, 17.188733853924695]\n";
}

}  // namespace plumbline::test
