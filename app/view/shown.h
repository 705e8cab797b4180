// What others in this process may look at: the newest state and, where somebody asks, the picture.
#pragma once

#include <memory>
#include <mutex>

#include "app/view_link/view_state.h"
#include "drivers/display/picture.h"

namespace plumbline {

/// Between the drawing thread, which puts, and others, which look. Nobody waits for more than a
/// copied pointer.
class Shown {
 public:
  static constexpr double kAskedFor_s = 3;

  void Put(std::shared_ptr<const ViewState> state);
  void Put(std::shared_ptr<const RgbImage> picture);

  /// Null: none yet.
  std::shared_ptr<const ViewState> state() const;
  /// Asks for pictures for the next kAskedFor_s as well. Null: none yet.
  std::shared_ptr<const RgbImage> Picture(double now_s);
  bool Asked(double now_s) const;

 private:
  mutable std::mutex mutex_;
  std::shared_ptr<const ViewState> state_;
  std::shared_ptr<const RgbImage> picture_;
  double asked_s_ = -1e300;
};

}  // namespace plumbline
