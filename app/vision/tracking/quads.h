// Detection of dark quadrilateral regions.
#pragma once

#include <array>
#include <vector>

#include "app/vision/tracking/threshold.h"

namespace plumbline::vision {

/// Four corners [px], clockwise as seen in the image (v downwards).
using Corners = std::array<lens::Vec2, 4>;

/// Finds the dark regions (4-connected) whose convex hull is nearly a quadrilateral. Only hulls are
/// examined; SnapToEdges verifies that a hull follows an edge in the image. Reuses its buffers, so
/// that steady-state frames allocate nothing.
class QuadFinder {
 public:
  struct Limits {
    int min_side = 5;        ///< of a region's bounding box [px of the search image]
    int max_side = 1 << 20;  ///< likewise
    int max_regions = 1500;  ///< only the largest ones are examined
  };

  explicit QuadFinder(const Limits& limits) : limits_(limits) {}

  /// Appends the quadrilaterals, in pixels of the whole image.
  void Find(const SearchImage& search, std::vector<Corners>& quads) {
    Find(search, limits_, quads);
  }
  void Find(const SearchImage& search, const Limits& limits, std::vector<Corners>& quads);

  /// True if the last image had more than max_regions regions: the smaller ones were skipped.
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
    int first_row;  ///< start of its rows in rows_
  };
  struct Extent {
    int x0, x1;
  };

  int RootOf(int run);
  void FindRuns(const SearchImage& search);
  void SelectRegions(const Limits& limits);
  void CollectRows();
  void HullOf(const Region& region);
  bool LargestQuad(Corners& quad) const;

  Limits limits_;
  bool limited_ = false;
  std::vector<Run> runs_;
  std::vector<Region> regions_;
  std::vector<Extent> rows_;
  std::vector<lens::Vec2> right_, left_, hull_;
};

}  // namespace plumbline::vision
