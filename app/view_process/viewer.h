// The viewer's knowledge of the cell: the newest state, the model in force, the scene, distances.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "app/log/log_entry.h"
#include "app/view/overlay.h"
#include "app/view_link/view_client.h"
#include "app/view_process/scene_worker.h"

namespace plumbline {

/// Takes states as they come, and gives what a picture is made from. Used by one thread.
class Viewer {
 public:
  /// @param config  as it was read from `config_file` without a version of the model
  Viewer(std::string config_file, ViewModel model, LogSink sink);

  /// Waits at most so long for a newer state. @return  whether one came
  bool Read(double timeout_s);
  /// Reads the configuration again; one with faults changes nothing.
  void Reload();

  /// What is to be said now; valid until the next call of anything here.
  const ViewFacts& Facts();
  const View& view() const { return view_; }
  /// From one state with an image to the next; infinite: none come.
  double image_interval_s() const;
  bool has_state() const { return has_state_; }
  const OverlayConfig& config() const { return overlay_; }
  /// Of the newest state's images, for OverlayInput.
  std::vector<const std::uint8_t*> Pixels() const;
  std::shared_ptr<const SceneNow> scene() const { return scene_; }
  const std::string& state_directory() const { return state_directory_; }

 private:
  void TakeModel(int version);
  bool HasOtherPoints(const ViewState& state);
  void StartScene();
  void TellScene();

  const std::string config_file_;
  const LogSink sink_;
  std::optional<ViewModel> model_;
  std::map<int, std::optional<Vec3>> points_B_;  ///< of the daemon, wanted; nothing: not told
  int refused_version_ = -1;  ///< not tried again until SIGHUP or another version
  OverlayConfig overlay_;
  std::string state_directory_;
  ViewClient client_;
  View view_;
  bool has_state_ = false;
  std::string link_problem_;
  void TakeSights(double now_s);
  void CountFrames();

  struct Eye {  ///< what is known of a camera from state to state
    CarrierMemory memory;
    double image_s = 0, frames_per_s = 0;
    std::uint64_t sequence = 0;
  };
  std::vector<Eye> eyes_;
  std::vector<Carriers> carriers_;  ///< of each camera; of none, one that sees nothing
  Carriers in_W_;                   ///< what they see together
  std::optional<SceneWorker> worker_;
  std::shared_ptr<const SceneNow> scene_ = std::make_shared<SceneNow>();
  std::shared_ptr<const Measured> measured_, told_;
  ViewFacts facts_;
};

}  // namespace plumbline
