// Input of a picture: newest state, model in force, scene and measurements.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "app/base/log/log_entry.h"
#include "app/cell/scene/scene_worker.h"
#include "app/cell/view_link/view_client.h"
#include "app/display/view/cell_view.h"
#include "app/display/view/overlay.h"

namespace plumbline::display {

/// Receives states and provides everything a picture is drawn from. Used by one thread.
class Viewer {
 public:
  /// @param model  configuration read from `config_file`, with the cell file as its model
  Viewer(std::string config_file, cell::ViewModel model, log::LogSink sink);

  /// Waits up to `timeout_s` for a newer state.
  /// @return  whether one arrived
  bool Read(double timeout_s);
  /// Reads the configuration again; if it has faults, nothing changes.
  void Reload();

  /// Input of the status texts; valid until the next call of a member function.
  const display::ViewFacts& Facts();
  const cell::View& view() const { return view_; }
  /// Mean interval between states with a new image; infinite if there are none.
  double image_interval_s() const;
  bool has_state() const { return has_state_; }
  const config::OverlayConfig& config() const { return overlay_; }
  /// Pixels of the newest state's images, for OverlayInput.
  std::vector<const std::uint8_t*> Pixels() const;
  /// Properties of the objects' meshes, for OverlayInput; valid while scene() is.
  std::vector<const scene::MeshFacts*> MeshFacts() const;
  std::shared_ptr<const cell::SceneSnapshot> scene() const { return scene_; }
  const std::string& state_directory() const { return state_directory_; }

 private:
  /// Reads the model that the daemon has in force.
  void LoadModel();
  void StartSceneWorker();

  const std::string config_file_;
  const log::LogSink sink_;
  std::optional<cell::ViewModel> model_;
  std::uint64_t generation_ = 0;  ///< of the daemon's configuration that `model_` was read for
  config::OverlayConfig overlay_;
  std::string state_directory_;
  cell::ViewClient client_;
  cell::View view_;
  bool has_state_ = false;
  std::string link_problem_;
  void UpdateCarriers(double now_s);
  void CountFrames();

  struct CameraTrack {  ///< per-camera data carried from state to state
    cell::CarrierTracker memory;
    double image_s = 0, frames_per_s = 0;
    std::uint64_t sequence = 0;
  };
  std::vector<CameraTrack> tracks_;
  std::vector<cell::Carriers> carriers_;  ///< of each camera; at least one
  Viewpoint viewpoint_;                   ///< used without a camera
  std::optional<cell::SceneWorker> worker_;
  std::shared_ptr<const cell::SceneSnapshot> scene_ = std::make_shared<cell::SceneSnapshot>();
  display::ViewFacts facts_;
};

}  // namespace plumbline::display
