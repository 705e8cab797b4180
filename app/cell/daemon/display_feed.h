// Feed of daemon states and camera images to the display program and other viewers.
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "app/base/config/daemon_config.h"
#include "app/cell/daemon/control_cycle.h"
#include "app/cell/view_link/view_publisher.h"
#include "app/vision/camera/camera_supervisor.h"

namespace plumbline::cell {

/// Publishes a state with every image and, while no images arrive, a few times a second without
/// one. If no viewer is connected it only polls for viewers. The control cycle is not aware of it:
/// everything shown is read from the mailboxes.
class DisplayFeed {
 public:
  /// @param publisher  null if the socket could not be created: nothing is published until Reopen()
  /// @param cameras    number of cameras; fixed until a restart
  DisplayFeed(std::unique_ptr<ViewPublisher> publisher, CycleMailboxes& mailboxes,
              std::size_t cameras);

  void Configure(const config::DaemonConfig& config);
  /// If there is no publisher yet, uses the one that `open` returns. Any thread.
  void Reopen(const std::function<std::unique_ptr<ViewPublisher>()>& open);
  /// To be called once snapshots are available.
  void Start(const ControlCycle& cycle);

  /// Publishes a state with an image. Called by the k-th camera's image thread for each image.
  void PublishImage(std::size_t k, camera::Camera& camera, const camera::CameraFrame& frame,
                    const vision::TrackedFrame& seen, const lens::KnownLens* lens);
  /// Publishes a state without an image if the last state is too old. Called often, by the main
  /// thread.
  void PublishIfDue();

 private:
  void Send();
  /// By the main thread only, which also replaces the link.
  void NoteLink(const robot::RobotLinkStatus& link);
  void CopyPoints(const Snapshot& snapshot);
  bool HasViewers();

  std::mutex mutex_;
  std::unique_ptr<ViewPublisher> publisher_;
  CycleMailboxes& mailboxes_;
  const ControlCycle* cycle_ = nullptr;
  model::CellModel cell_;
  std::vector<int> point_ids_;
  std::vector<ViewCamera> cameras_;
  ViewState state_;  ///< sent last; its points are kept until they change
  std::optional<std::uint64_t> point_changes_;  ///< Snapshot::point_changes of these points
  double sent_s_ = -1e300;
  double start_s_ = 0;
  double scene_s_ = -1e300;  ///< time of the last scene status that a viewer reported
};

}  // namespace plumbline::cell
