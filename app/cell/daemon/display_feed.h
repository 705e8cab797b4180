// Feed of daemon states and camera images to the display program and other viewers.
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "app/cell/daemon/control_cycle.h"
#include "app/cell/daemon/model_in_force.h"
#include "app/cell/scene/scene_worker.h"
#include "app/cell/view_link/view_publisher.h"
#include "app/vision/camera/camera_supervisor.h"

namespace plumbline::cell {

/// Publishes a state with every image and, while no images arrive, a few times a second without
/// one. If there is an object table, a thread of its own measures in each of these states, also
/// without viewers; otherwise, without viewers nothing is done but to poll for them. The control
/// cycle is not aware of it: everything shown is read from the mailboxes, and the interference is
/// written to one.
class DisplayFeed {
 public:
  /// @param publisher  null if the socket could not be created: nothing is published until Reopen()
  /// @param cameras    number of cameras; fixed until a restart
  DisplayFeed(std::unique_ptr<ViewPublisher> publisher, CycleMailboxes& mailboxes,
              std::size_t cameras);

  void Configure(const ConfigInForce& in_force);
  /// If there is no publisher yet, uses the one that `open` returns. Any thread.
  void Reopen(const std::function<std::unique_ptr<ViewPublisher>()>& open);
  /// To be called once snapshots are available.
  void Start(const ControlCycle& cycle);

  /// Publishes a state with an image. Called by the k-th camera's image thread for each image.
  void PublishImage(std::size_t k, camera::Camera& camera, const camera::CameraFrame& frame,
                    const vision::TrackedFrame& seen, const lens::KnownLens* lens,
                    const lens::BoardGuidance* guidance);
  /// Publishes a state without an image if the last state is too old. Called often, by the main
  /// thread.
  void PublishIfDue();

 private:
  /// Fills the state and hands it to the viewers and to the thread that measures.
  void Send(bool has_viewers);
  /// Starts measuring in a state; the state gets what was measured last.
  void MeasureIn(ViewState& state);
  /// Passes a new measurement to the control cycle.
  void NoteMeasured();
  void PublishSceneStatus(const status::SceneStatus& status);
  /// By the main thread only, which also replaces the link.
  void NoteLink(const robot::RobotLinkStatus& link);
  void CopyPoints(const Snapshot& snapshot);
  bool HasViewers() { return publisher_ && publisher_->PollViewers(); }
  bool Needed(bool has_viewers) const { return cycle_ != nullptr && (has_viewers || scene_); }

  std::mutex mutex_;
  std::unique_ptr<ViewPublisher> publisher_;
  CycleMailboxes& mailboxes_;
  const ControlCycle* cycle_ = nullptr;
  std::optional<ViewModel> model_;
  std::vector<int> point_ids_;
  std::vector<ViewCamera> cameras_;
  ViewState state_;  ///< sent last; its points are kept until they change
  std::optional<std::uint64_t> point_changes_;  ///< Snapshot::point_changes of these points
  double sent_s_ = -1e300;
  double start_s_ = 0;
  std::vector<CarrierTracker> trackers_;               ///< of each camera; at least one
  std::unique_ptr<SceneWorker> scene_;                 ///< null without an object table
  std::vector<std::unique_ptr<SceneWorker>> ending_;   ///< replaced ones, which may need seconds
  std::shared_ptr<const SceneMeasurements> measured_;  ///< the newest
};

}  // namespace plumbline::cell
