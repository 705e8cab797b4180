// What a person sees on the display of a running daemon.
#pragma once

#include <string>
#include <vector>

#include "app/cell/view_link/view_client.h"

namespace plumbline::test {

/// Outline in which the first camera wants the calibration board, as shown last.
class WatchedDisplay {
 public:
  explicit WatchedDisplay(const std::string& state_directory)
      : client_(cell::ViewSocketOf(state_directory), false) {}

  /// @return  empty if no outline is shown
  const std::vector<lens::Vec2>& Outline() {
    cell::View view;
    if (client_.Read(0.5, view)) {
      const auto& guidance = cell::CameraOf(view.state, 0).guidance;
      outline_ = guidance ? guidance->wanted_px : std::vector<lens::Vec2>{};
    }
    return outline_;
  }

 private:
  cell::ViewClient client_;
  std::vector<lens::Vec2> outline_;
};

}  // namespace plumbline::test
