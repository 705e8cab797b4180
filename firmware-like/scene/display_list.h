// What is to be drawn: plain values, made by the scene, read by the renderer.
//
// Pixel (0, 0) is the centre of the top-left pixel of the drawn picture; panels and text are in its
// pixels, everything else in the camera frame C [m].
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "firmware-like/lens/luma_view.h"
#include "firmware-like/scene/bend_field.h"

namespace plumbline {

struct Colour {
  float r = 1, g = 1, b = 1, a = 1;  ///< 0..1, not multiplied by a
};

/// The camera's image, undistorted while it is drawn.
struct Background {
  LumaView luma;  ///< no data: none, a plain colour
  const std::uint8_t* bgr =
      nullptr;                 ///< the same image in colour, rows without padding; null: grey
  std::uint64_t sequence = 0;  ///< the same number: the same image, need not be loaded again
  std::optional<Lens> lens;    ///< nothing: drawn as it is
};

/// A mesh, by the number the renderer gave it when it was loaded. A point p_O goes to
///   p_C = X_CF Bent(X_FO (scale p_O)).
struct DrawnMesh {
  int mesh = 0;
  Pose X_CF;  ///< of its carrier: the flange, a tag, the cell
  Pose X_FO;  ///< of the object in its carrier
  double scale = 1;
  bool bends = false;      ///< by `bend` of the list; its carrier is then the flange
  bool occludes = false;   ///< not seen itself: hides what is behind it, as the cell does
  bool by_stress = false;  ///< coloured by the stress of its section
  Colour colour = {};
};

/// Straight pieces from point to point: datum lines, approach paths, axes.
struct DrawnLine {
  std::vector<Vec3> points_C;
  Colour colour = {};
  float width_px = 2;
  bool dashed = false;
  bool always_in_front = false;
};

/// What lies on the other side, where normal . p > distance, is cut away. A grid in it can be seen.
struct ClipPlane {
  Vec3 normal_C = Vec3::UnitZ();
  double distance_m = 0;
  bool grid = true;
};

/// A part of the picture, edges in pixels: 0 is the left or upper edge of the first one.
struct Area {
  float x = 0, y = 0, width = 0, height = 0;
  float right() const { return x + width; }
  float bottom() const { return y + height; }
};

struct DrawnBox {
  float x = 0, y = 0;           ///< its top-left pixel [px]
  float width = 0, height = 0;  ///< [px]
  Colour colour = {};
};

struct DrawnText {
  float x = 0, y = 0;    ///< left end of the base line [px]: the first row below it
  float height_px = 16;  ///< of the font's em square
  Colour colour = {};
  std::string text;  ///< UTF-8
};

/// One picture: what one camera sees, boxes and texts over it.
struct DisplayList {
  ImageSize size;            ///< of the picture [px]
  std::optional<Area> area;  ///< of what the camera sees, where that is not the whole picture
  Lens pinhole;              ///< of the picture; its distortion terms are zero
  Background background;
  BendField bend;
  double exaggeration = 1;    ///< d and r are multiplied by it
  double stress_full_Pa = 0;  ///< the top of the colour scale
  std::optional<ClipPlane> clip;
  std::vector<DrawnMesh> meshes;
  std::vector<DrawnLine> lines;
  std::vector<DrawnBox> boxes;   ///< over all else, in order
  std::vector<DrawnText> texts;  ///< over the boxes
  /// What further cameras see, each in an area of its own of the same picture; their boxes, texts
  /// and `beside` are not drawn.
  std::vector<DisplayList> beside;
};

}  // namespace plumbline
