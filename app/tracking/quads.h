// Dark regions of an image that are bordered by four straight sides.
#pragma once

#include <array>
#include <vector>

#include "app/tracking/threshold.h"

namespace plumbline {

/// Four corners [px], clockwise as seen in the image (v downwards).
using Corners = std::array<Vec2, 4>;

/// Finds the dark regions (joined by their sides) whose convex hull is nearly a quadrilateral. It
/// looks at hulls only: that the hull follows an edge in the image is found out by SnapToEdges.
/// Keeps its working memory, so that a frame allocates nothing once it is warm.
class QuadFinder {
 public:
  struct Limits {
    int least_side = 5;       ///< of a region's bounding box [px of the search image]
    int most_regions = 1500;  ///< the largest of them are looked at
  };

  explicit QuadFinder(const Limits& limits) : limits_(limits) {}

  /// Appends the quadrilaterals, in pixels of the whole image.
  void Find(const SearchImage& search, std::vector<Corners>& quads);

  /// More regions than most_regions were there in the last image: the smaller ones were left out.
  bool limited() const { return limited_; }

 private:
  struct Run {
    int y, x0, x1;  ///< dark pixels x0 <= x < x1 of row y
    int parent;     ///< index of a run of the same region, itself for the root
    int region;     ///< of a root: its index in regions_, or -1
  };
  struct Region {
    int x0, y0, x1, y1;  ///< bounding box, half open
    int root;
    int first_row;  ///< where its rows begin in rows_
  };
  struct Extent {
    int x0, x1;
  };

  int RootOf(int run);
  void FindRuns(const SearchImage& search);
  void SelectRegions();
  void CollectRows();
  void HullOf(const Region& region);
  bool LargestQuad(Corners& quad) const;

  Limits limits_;
  bool limited_ = false;
  std::vector<Run> runs_;
  std::vector<Region> regions_;
  std::vector<Extent> rows_;
  std::vector<Vec2> right_, left_, hull_;
};

}  // namespace plumbline
