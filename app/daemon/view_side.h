// What the daemon shows, put together from its parts.
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <vector>

#include "app/camera/camera_supervisor.h"
#include "app/config/daemon_config.h"
#include "app/daemon/cyclic_loop.h"
#include "app/view_link/view_publisher.h"

namespace plumbline {

/// Sends a state with every image, and without images a few times a second. Where nobody looks it
/// does nothing but look whether somebody does. The cycle knows nothing of it: what it shows it
/// takes from the mailboxes.
class ViewSide {
 public:
  /// @param publisher  null where the socket could not be made: nothing is shown until OpenAgain()
  /// @param cameras    how many there are, until a restart
  ViewSide(std::unique_ptr<ViewPublisher> publisher, LoopLink& link, std::size_t cameras);

  void Configure(const DaemonConfig& config);
  /// Where there is no publisher yet: takes what `open` gives. Any thread.
  void OpenAgain(const std::function<std::unique_ptr<ViewPublisher>()>& open);
  /// From here on there are snapshots.
  void Start(const CyclicLoop& loop);

  /// By the images' thread of the k-th camera, for each image.
  void TakeImage(std::size_t k, Camera& camera, const CameraFrame& frame, const TrackedFrame& seen,
                 const Lens* lens);
  /// By the thread that watches over the daemon, often: sends where no image does.
  void TakeTime();

 private:
  void Send();
  bool Watched();

  std::mutex mutex_;
  std::unique_ptr<ViewPublisher> publisher_;
  LoopLink& link_;
  const CyclicLoop* loop_ = nullptr;
  std::string cell_;
  std::vector<int> point_ids_;
  std::vector<ViewCamera> cameras_;
  double sent_s_ = -1e300;
  double start_s_ = 0;
  double scene_s_ = -1e300;  ///< of what was told of virtual objects
};

}  // namespace plumbline
