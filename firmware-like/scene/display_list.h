// Display list: plain description of one picture, built by the scene and drawn by the renderer.
//
// Pixel (0, 0) is the centre of the top-left pixel of the picture. Boxes, strokes and texts are in
// pixels;
// everything else is in the camera frame C [m].
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "firmware-like/image/luma_view.h"
#include "firmware-like/lens/known_lens.h"
#include "firmware-like/lens/lens.h"
#include "firmware-like/scene/bend_field.h"

namespace plumbline {

inline bool operator==(const Pose& a, const Pose& b) {
  return a.R == b.R && a.p == b.p;
}

namespace lens {
inline bool operator==(const Lens& a, const Lens& b) {
  return VectorOfLens(a) == VectorOfLens(b) && a.fisheye == b.fisheye;
}
}  // namespace lens

namespace image {
inline bool operator==(const LumaView& a, const LumaView& b) {
  return a.data == b.data && a.size() == b.size() && a.stride == b.stride;
}
}  // namespace image

}  // namespace plumbline

namespace plumbline::scene {

struct Colour {
  float r = 1, g = 1, b = 1, a = 1;  ///< 0..1, not premultiplied
  bool operator==(const Colour&) const = default;
};

/// The camera image, undistorted when it is drawn.
struct Background {
  image::LumaView luma;               ///< without data: plain colour
  const std::uint8_t* bgr = nullptr;  ///< the same image in colour, rows not padded; null if grey
  std::uint64_t sequence = 0;         ///< unchanged: the same image, no upload needed
  std::optional<lens::Lens> lens;     ///< if nullopt, drawn without undistortion

  bool operator==(const Background&) const = default;
};

/// Numbers of the solids that every renderer has: a cylinder of radius 1 about z from 0 to 1, and a
/// sphere of radius 1.
inline constexpr int kUnitCylinder = -1, kUnitSphere = -2;

/// A mesh, identified by the number the renderer returned on loading. A point p_O is drawn at
///   p_C = X_CF Bent(X_FO (scale stretch p_O)),  stretch acting along each axis of O.
struct DrawnMesh {
  int mesh = 0;
  Pose X_CF;  ///< pose of the carrier: the flange, a tag or the cell
  Pose X_FO;  ///< pose of the object on its carrier
  double scale = 1;
  Vec3 stretch = Vec3::Ones();  ///< for the unit solids
  bool bends = false;           ///< deformed by the list's `bend`; the carrier is then the flange
  bool occludes = false;        ///< invisible, but hides what is behind it
  bool by_stress = false;       ///< coloured by the stress of the section
  Colour colour = {};
  bool operator==(const DrawnMesh&) const = default;
};

/// A polyline: datum lines, approach paths, axes.
struct DrawnLine {
  std::vector<Vec3> points_C;
  Colour colour = {};
  float width_px = 2;
  bool dashed = false;
  bool always_in_front = false;
  bool operator==(const DrawnLine&) const = default;
};

/// Clips everything with normal . p > distance. The plane can show a grid.
struct ClipPlane {
  Vec3 normal_C = Vec3::UnitZ();
  double distance_m = 0;
  bool grid = true;
  bool operator==(const ClipPlane&) const = default;
};

/// A faint grid in a plane, behind everything. It ends where its lines would be closer than two
/// pixels.
struct GroundGrid {
  Pose X_CG;          ///< the grid lies in the plane z = 0 of G, with a line through its origin
  double cell_m = 1;  ///< distance between the lines
  float opacity = 0.2F;
  bool operator==(const GroundGrid&) const = default;
};

/// A rectangle of the picture, edges in pixels; 0 is the left or upper edge of the first pixel.
struct Area {
  float x = 0, y = 0, width = 0, height = 0;
  float right() const { return x + width; }
  float bottom() const { return y + height; }
  bool operator==(const Area&) const = default;
};

struct DrawnBox {
  float x = 0, y = 0;           ///< top-left pixel [px]
  float width = 0, height = 0;  ///< [px]
  Colour colour = {};
  bool operator==(const DrawnBox&) const = default;
};

/// A point of the picture; 0 is the left or upper edge of the first pixel.
struct PicturePoint {
  float x = 0, y = 0;  ///< [px]
  bool operator==(const PicturePoint&) const = default;
};

/// A polyline of the picture: leader lines and marks. Its first and last point coincide if it is
/// closed.
struct DrawnStroke {
  std::vector<PicturePoint> points;
  Colour colour = {};
  float width_px = 2;
  bool filled = false;  ///< a closed convex polyline is filled
  bool operator==(const DrawnStroke&) const = default;
};

struct DrawnText {
  float x = 0, y = 0;    ///< left end of the base line [px]; y is the first row below it
  float height_px = 16;  ///< height of the font's em square
  Colour colour = {};
  std::string text;  ///< UTF-8
  bool operator==(const DrawnText&) const = default;
};

/// One picture: a camera view with boxes, strokes and texts on top.
struct DisplayList {
  image::ImageSize size;     ///< of the picture [px]
  std::optional<Area> area;  ///< area of the camera view; the whole picture if nullopt
  lens::Lens pinhole;        ///< projection of the camera view; distortion terms are zero
  Background background;
  BendField bend;
  double exaggeration = 1;    ///< factor on d and r of `bend`
  double stress_full_Pa = 0;  ///< upper end of the colour scale
  std::optional<GroundGrid> ground;
  std::optional<ClipPlane> clip;
  std::vector<DrawnMesh> meshes;
  std::vector<DrawnLine> lines;
  std::vector<DrawnBox> boxes;       ///< drawn last, in order
  std::vector<DrawnStroke> strokes;  ///< drawn on top of the boxes
  std::vector<DrawnText> texts;      ///< drawn on top of the strokes
  /// Views of further cameras, each in its own area of the same picture. Their boxes, strokes,
  /// texts and `beside` are not drawn.
  std::vector<DisplayList> beside;
  bool operator==(const DisplayList&) const = default;
};

}  // namespace plumbline::scene
