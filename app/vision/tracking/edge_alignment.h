// Alignment of a rough quadrilateral with the edges in an image, to a third of a pixel.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "app/vision/tracking/quads.h"
#include "firmware-like/image/luma_view.h"

namespace plumbline::vision {

struct EdgeSearch {
  double reach_px = 4;  ///< search range on either side of the rough side
  double min_step = 5;  ///< smallest dark-to-bright step [grey levels]
  /// Share of the positions along a side that must show such a step: of each side, and of all four
  /// on average. Something dark may hide a part of a side.
  double min_share = 0.4, min_mean_share = 0.7;
};

/// The parts along a side where its edge is hidden.
class HiddenParts {
 public:
  /// @param from,to  in 0..1 along the side
  void Hide(double from, double to);
  bool any() const { return bits_ != 0; }
  bool Hides(double s) const { return bits_ != 0 && ((bits_ >> PartOf(s)) & 1) != 0; }

 private:
  static constexpr int kParts = 32;
  static int PartOf(double s);
  std::uint32_t bits_ = 0;
};

/// What AlignWithEdges finds along the sides.
struct AlignedSides {
  std::array<HiddenParts, 4> hidden;  ///< where a side shows no step
  /// Mean share of a step that occurs within two pixels: 0.66 if the blur's standard deviation is
  /// 0.9 px, 0.47 if it is 1.5 px.
  double sharpness = 0;
  double scatter_px = 0;  ///< mean distance of the steepest points from the lines
};

/// Moves the sides onto the steps from dark inside to bright outside: finds the steepest point of
/// up to 24 profiles across each side, fits a straight line to these points without outliers, and
/// intersects the four lines.
/// @return  nullopt unless all four sides follow an edge: the quadrilateral is not a tag
std::optional<AlignedSides> AlignWithEdges(const image::LumaView& image, const EdgeSearch& search,
                                           Corners& corners);

}  // namespace plumbline::vision
