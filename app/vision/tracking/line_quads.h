// Quadrilaterals from four edge segments that enclose a dark side.
#pragma once

#include <vector>

#include "app/vision/tracking/edge_segments.h"
#include "app/vision/tracking/quads.h"

namespace plumbline::vision {

/// Combines edge segments to dark quadrilaterals: four lines that turn clockwise, each of which is
/// visible along a part of its side. A side may be interrupted: collinear segments are joined. A
/// quadrilateral need not be a region of its own. Reuses its buffers.
class LineQuads {
 public:
  /// Appends the quadrilaterals, in pixels of the whole image.
  void Find(const SearchImage& search, const std::vector<EdgeSegment>& segments,
            std::vector<Corners>& quads);

 private:
  struct Successor {
    int line;
    float gap;  ///< hidden parts of both lines at their corner [px]
    lens::Vec2 corner;
  };

  void SelectLines(const std::vector<EdgeSegment>& segments);
  void Join();
  void FindSuccessors();
  void Close(int first, const SearchImage& search, std::vector<Corners>& quads) const;

  std::vector<EdgeSegment> lines_;     ///< segments, and joined ones; by x of the start
  std::vector<Successor> successors_;  ///< of all lines
  std::vector<int> successors_start_;  ///< by line, and the end
  std::vector<Successor> candidates_;
};

}  // namespace plumbline::vision
