// Printed sheets as values: black areas, lines and texts in millimetres.
//
// Sheet frame: origin at the top left corner of the paper, x to the right, y down.
#pragma once

#include <string>
#include <vector>

#include "firmware-like/lens/lens.h"

namespace plumbline::vision {

using lens::Vec2;

/// Closed polygon [mm]; the last corner is joined to the first.
using Outline = std::vector<Vec2>;

struct Rectangle {
  Vec2 corner = Vec2::Zero(), size = Vec2::Zero();  ///< top left corner, width and height [mm]

  Vec2 end() const { return corner + size; }
  Vec2 centre() const { return corner + 0.5 * size; }
};

/// Black disc [mm].
struct Disc {
  Vec2 centre;
  double radius = 0;
};

struct Line {
  Vec2 from, to;       ///< [mm]
  double width = 0.2;  ///< [mm]
  double grey = 0;     ///< 0 black .. 1 white
};

enum class Font { kPlain, kBold, kFixedPitch };
enum class Align { kLeft, kCentre, kRight };

struct Text {
  Vec2 at;  ///< on the baseline: its left end, middle or right end, as aligned [mm]
  std::string words;
  double size = 2.6;       ///< of the font [mm]
  double max_width = 1e3;  ///< a wider text is set in a smaller size [mm]
  Font font = Font::kPlain;
  Align align = Align::kLeft;
};

struct Sheet {
  std::vector<Outline> outlines;  ///< black inside an odd number of them
  std::vector<Disc> discs;
  std::vector<Line> lines;
  std::vector<Text> texts;
};

/// Sheets of one paper size.
struct Document {
  std::string title;
  Vec2 size = Vec2::Zero();  ///< width and height of the paper [mm]
  std::vector<Sheet> sheets;
};

}  // namespace plumbline::vision
