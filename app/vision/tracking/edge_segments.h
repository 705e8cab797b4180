// Straight segments of the edges in an image, directed so that the dark side is on the right.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "app/vision/tracking/threshold.h"

namespace plumbline::vision {

/// A straight piece of an edge. Seen from start to end, the dark side is on the right: the outline
/// of a dark shape runs clockwise (v downwards).
struct EdgeSegment {
  lens::Vec2 start, end;  ///< [px of the search image]
  lens::Vec2 direction;   ///< unit vector
  double length = 0;      ///< [px of the search image]
};

/// Finds edge pixels (maxima of the gradient across the edge), links them to chains along the edge
/// and splits the chains into straight segments. Independent of the threshold: a shadow, or another
/// dark thing beside a shape, does not change the segments of the rest of its outline. Only tiles
/// with contrast (SearchImage::contrast) are examined. Reuses its buffers.
class EdgeSegmentFinder {
 public:
  struct Limits {
    int min_step = 10;      ///< smallest step over two pixels, summed over both axes [grey levels]
    double min_length = 6;  ///< of a segment [px of the search image]
  };

  void Find(const SearchImage& search, const Limits& limits, std::vector<EdgeSegment>& segments);

 private:
  struct EdgePixel {
    int x, y;
    float u, v;              ///< to a fraction of a pixel
    float along_u, along_v;  ///< unit vector along the edge, the dark side on its right
    int next;                ///< the following pixel of the edge, -1 at its end
    bool has_previous;
    bool used;
  };

  void FindPixels(const SearchImage& search, int min_step);
  void AddRow(const SearchImage& search, int y, int x0, int x1, int buffer_row, int min_step);
  void Link();
  void Split(int first, double min_length, std::vector<EdgeSegment>& segments);

  std::vector<EdgePixel> pixels_;          ///< row by row, from left to right
  std::vector<int> row_start_;             ///< index in pixels_ by row, and the end
  std::vector<std::pair<int, int>> runs_;  ///< columns with contrast in a row of tiles
  std::vector<std::int16_t> step_;         ///< |gx| + |gy| of six rows
  std::vector<std::int16_t> gu_, gv_;
  std::vector<std::int16_t> is_edge_;  ///< of one row
};

}  // namespace plumbline::vision
