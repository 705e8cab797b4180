// Detection of dark quadrilateral regions.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "app/vision/tracking/threshold.h"

namespace plumbline::vision {

/// Four corners [px], clockwise as seen in the image (v downwards).
using Corners = std::array<lens::Vec2, 4>;

/// Whether each corner of one quadrilateral is near a corner of the other.
bool AreAlike(const Corners& a, const Corners& b, double reach_px);

/// Quadrilaterals of an image, to recognise one that occurs again. A hash table over the places of
/// their middles.
class QuadSet {
 public:
  void Clear();
  /// @param reach_px  between corners of the same quadrilateral, less than kPlace_px
  /// @return          false if one that is alike is there already
  bool Add(const Corners& quad, double reach_px);

 private:
  static constexpr int kPlace_px = 16;
  static constexpr std::size_t kChains = 4096;
  struct Entry {
    Corners quad;
    int next;  ///< of the same chain, or -1
  };
  static std::size_t ChainOf(int place_u, int place_v);

  std::vector<int> first_ = std::vector<int>(kChains, -1);  ///< entry by chain
  std::vector<Entry> entries_;
};

/// Finds the dark regions (4-connected) whose convex hull is nearly a quadrilateral. Only hulls are
/// examined; AlignWithEdges verifies that a hull follows an edge in the image. Reuses its buffers,
/// so that steady-state frames allocate nothing.
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
