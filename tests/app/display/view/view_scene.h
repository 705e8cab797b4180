// Fixture: the demo cell as the viewer receives it, with configuration files, a camera 1.5 m beside
// the loaded tip, and a daemon state without faults.
#pragma once

#include <catch2/catch.hpp>
#include <fstream>

#include "app/cell/scene/carriers.h"
#include "firmware-like/geometry/rotation.h"
#include "tests/app/cell/daemon/demo_config.h"
#include "tests/app/temporary_folder.h"

namespace plumbline::test {

/// Pose of the cell's tags in W, as [tags] below states it.
inline const Pose kMarksInW{RotationFromRollPitchYaw(Vec3(0.1, 0.2, 0.3)), Vec3(2.0, 0.1, 0.8)};

inline std::string ViewConfigText(const std::string& folder, const std::string& overlay = "") {
  std::ofstream(folder + "/bodies.toml") << "schema = 1\n"
                                            "[[body]]\nname = \"cell\"\nsize_mm = 60.0\n"
                                            "[[body.tag]]\nid = 0\nxyz_mm = [0.0, 0.0, 0.0]\n"
                                            "[[body.tag]]\nid = 1\nxyz_mm = [300.0, 0.0, 0.0]\n"
                                            "[[body]]\nname = \"gripper\"\nsize_mm = 60.0\n"
                                            "[[body.tag]]\nid = 20\nxyz_mm = [0.0, 0.0, 0.0]\n";
  return WithLine(DemoConfig("127.0.0.1:1502", "universal-robots-fine"), "", "state_directory",
                  "\"" + folder + "/state\"") +
         "\n[camera]\nkind = \"recorded\"\npath = \"frames\"\nserial = \"test camera\"\n"
         "mode = \"test mode\"\n[tags]\nfile = \"" +
         folder +
         "/bodies.toml\"\ncell_xyz_mm = [2000.0, 100.0, 800.0]\n"
         "cell_rpy_deg = [5.729577951308232, 11.459155902616464, 17.188733853924695]\n"
         "[overlay]\n" +
         overlay;
}

struct ViewScene {
  static constexpr double kNow_s = 5000;

  TemporaryFolder folder;
  std::optional<cell::ViewModel> model;
  cell::ViewState state;
  Pose X_CW;  ///< the truth
  cell::CarrierTracker memory;

  explicit ViewScene(const std::string& overlay = "") {
    std::ofstream(ConfigFile()) << ViewConfigText(folder.path(), overlay);
    config::FaultList faults;
    model = cell::ReadViewModel(ConfigFile(), 0, faults);
    INFO(config::FaultsText(faults));
    REQUIRE(model);

    state.now_s = kNow_s - 0.02;
    state.utc_s = 1.8e9;
    state.cell = "demo cell";
    state.version = "0.1.0";
    state.q.resize(6);
    state.q << 0, -100, 110, 0, -10, 0;
    state.q *= kRadPerDeg;
    state.payload_kg = 40;
    state.payload_cog_F = Vec3(0.02, -0.05, 0.9);
    for (const correction::AssemblyPoint& point : model->config.machine.points) {
      cell::ViewPoint output;
      output.id = point.id;
      output.valid = true;
      output.code = correction::CorrectionCode::kOk;
      output.translation_B = Vec3(0.001, -0.002, 0.0035);
      output.uncertainty_m = 0.0003;
      output.basis = model::RadiusBasis::kMeasured;
      output.q = state.q;
      output.taught = true;
      state.points.push_back(output);
    }
    state.cameras.resize(1);
    state.cameras[0].status.configured = true;
    state.cameras[0].status.state = lens::ZoomState::kValid;
    state.cameras[0].status.reason = lens::ZoomReason::kTagsGood;
    state.cameras[0].status.zoom_counts = 4000;
    state.cameras[0].status.lens_id = 1;
    // Beside the tip; the image's right points along x of W.
    deflection::LoadedState loaded;
    REQUIRE(model->arm.AtCommanded(state.q, {*state.payload_kg, state.payload_cog_F}, {}, loaded));
    X_CW.R << 1, 0, 0, 0, 0, -1, 0, 1, 0;
    X_CW.p = Vec3(0.02, -0.03, 1.5) - X_CW.R * loaded.X_WT.p;
    state.cameras[0].serial = "test camera";
    state.cameras[0].mode = "test mode";
    state.cameras[0].lens = lens::Lens{1700, 1701, 955, 541, -0.08, 0.02, 1e-4, -2e-4, 0};
    state.cameras[0].image = cell::ViewImage{0, 7, 1920, 1080, false, kNow_s - 0.03, 70};
    state.cameras[0].bodies = {
        {"cell", X_CW * kMarksInW, false},
        {"gripper", {RotationFromVector(Vec3(0.1, 0, 0)), Vec3(0, 0, 1.4)}, false}};
    for (const int id : {0, 1, 20}) {
      cell::ViewTag tag;
      tag.id = id;
      tag.X_CM = Pose{Mat3::Identity(), Vec3(0.1 * id, 0, 1.5)};
      state.cameras[0].tags.push_back(tag);
    }
    state.lines = {{1, 1.8e9 - 100, 5, "plumblined 0.1.0 with the demo cell"},
                   {2, 1.8e9 - 10, 4, "the zoom changed"}};
  }
  std::string ConfigFile() const { return folder.path() + "/plumbline.toml"; }
  cell::Carriers Placed(double now_s = kNow_s) { return memory.Update(state, 0, &*model, now_s); }
};

}  // namespace plumbline::test
