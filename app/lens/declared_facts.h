// Facts about a camera that its owner declares, because its images seldom show or exclude the
// opposite.
#pragma once

namespace plumbline::lens {

struct DeclaredFacts {
  /// No pane of glass is in front of the lens: no window of a housing, no door, no filter.
  bool no_window = false;
  /// The focal length is the same in all frames: no autofocus, and no zoom or focus drive that
  /// moves by itself.
  bool fixed_focus = false;

  bool operator==(const DeclaredFacts&) const = default;
};

}  // namespace plumbline::lens
