// Facts about a camera that its owner declares, because its images seldom show or exclude the
// opposite.
#pragma once

#include <string>

namespace plumbline::target {

struct DeclaredFacts {
  /// No pane of glass is in front of the lens: no window of a housing, no door, no filter.
  bool no_window = false;
  /// The focal length is the same in all frames: no autofocus, and no zoom or focus drive that
  /// moves by itself.
  bool fixed_focus = false;
  /// The pixels are not square, as those of a camera with an analogue signal or a scaled image.
  /// Otherwise fy / fx = 1 is expected of a lens.
  bool oblong_pixels = false;

  bool operator==(const DeclaredFacts&) const = default;
};

/// The facts that `needed` has and `declared` lacks.
DeclaredFacts MissingOf(const DeclaredFacts& needed, const DeclaredFacts& declared);

/// Whether everything that `needed` declares is declared.
bool Includes(const DeclaredFacts& declared, const DeclaredFacts& needed);

/// "no_window, fixed_focus, oblong_pixels", the names of the keys; empty if nothing is declared.
std::string TextOf(const DeclaredFacts& facts);

}  // namespace plumbline::target
