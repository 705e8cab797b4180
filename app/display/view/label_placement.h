// Placement of labels and insets over an image so that they cover neither marks nor each other.
#pragma once

#include <optional>
#include <vector>

#include "firmware-like/scene/display_list.h"

namespace plumbline::display {

struct LeaderLine {
  scene::PicturePoint from, to;  ///< from the labelled point to the label's edge
};

struct PlacedLabel {
  scene::Area area;
  LeaderLine leader;
};

enum class Corner { kTopLeft, kTopRight, kBottomLeft, kBottomRight };

/// Greedy placement: whatever is placed first keeps its area. Pure; the same input gives the same
/// picture, so that labels stay where they are while nothing moves.
class LabelPlacer {
 public:
  /// @param em  height of the text [px], the unit of all distances
  LabelPlacer(const scene::Area& image, float em) : image_(image), em_(em) {}

  /// Nothing may cover this area. It is rounded up to half an em, so that noise moves nothing.
  void KeepClear(const scene::Area& area);

  /// Places a label beside `at`, clear of everything, with a short leader line that covers no mark
  /// and crosses as few labels and other lines as possible.
  /// @return  nullopt if `at` is outside the image or there is no such place
  std::optional<PlacedLabel> Place(const scene::PicturePoint& at, float width, float height);

  /// Reserves an area in the first of the corners where it covers nothing.
  /// @return  nullopt if there is none
  std::optional<scene::Area> TakeFreeCorner(float width, float height,
                                            const std::vector<Corner>& corners);
  /// The same, or else the corner where it covers least.
  scene::Area TakeCorner(float width, float height, const std::vector<Corner>& corners);

 private:
  scene::Area InCorner(float width, float height, Corner corner) const;
  float CoveredBy(const scene::Area& area) const;
  bool IsFree(const scene::Area& area) const;
  /// Whether a leader line covers a mark other than those that contain the labelled point.
  bool CrossesMark(const LeaderLine& leader) const;
  float CrossingCost(const LeaderLine& leader) const;
  void Take(const PlacedLabel& label);

  const scene::Area image_;
  const float em_;
  std::vector<scene::Area> kept_clear_, taken_;
  std::vector<LeaderLine> leaders_;
};

/// The parts of a line outside the areas: it passes behind labels, so that they stay legible.
std::vector<LeaderLine> PartsOutside(const LeaderLine& line,
                                     const std::vector<PlacedLabel>& labels);

/// Overlap of two areas [px^2].
float OverlapOf(const scene::Area& a, const scene::Area& b);

}  // namespace plumbline::display
