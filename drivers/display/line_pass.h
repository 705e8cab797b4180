// Render pass for lines of constant pixel width and for the grid in the clip plane.
#pragma once

#include "drivers/display/gl_objects.h"
#include "firmware-like/scene/display_list.h"

namespace plumbline::display {

/// Each segment is an antialiased rectangle with round caps; dashes continue across segments. Lines
/// are drawn 1/1000 closer to the camera than they are, so that a line on a surface is visible.
/// Segments behind the camera or beyond the clip plane are cut.
///
/// The grid of the clip plane has a line every 0.1 m and a stronger one every 1 m. Its origin is
/// the foot of the perpendicular from the origin of C, and one axis is the x axis of C projected
/// into the plane.
class LinePass {
 public:
  static Result<LinePass> Create();

  /// Draws against the depth buffer left by the meshes.
  void Draw(const scene::DisplayList& list);
  /// Draws the ground grid over the background, regardless of depth.
  void DrawGround(const scene::DisplayList& list);

 private:
  /// A grid in the plane normal . p = distance.
  struct Grid {
    Vec3 normal_C;
    double distance_m = 0;
    Vec3 first_per_m, second_per_m;  ///< directions of the grid, divided by the cell size
    Vec3 origin_C = Vec3::Zero();    ///< a point where lines cross
    float opacity = 0.8F;
    float fine_opacity = 0.35F;  ///< of lines at a tenth of the distance; 0: none
  };
  struct Vertex {
    float x, y, z;                  ///< pixel centres at integers; z is depth, -1..1
    float along, across, length;    ///< position within the segment [px]
    float start, half_width, dash;  ///< start along the line [px]; dash 0: solid
    float r, g, b, a;
  };

  void AddLine(const scene::DisplayList& list, const scene::DrawnLine& line);
  void DrawLines(const scene::DisplayList& list);
  void DrawGrid(const lens::Lens& pinhole, const Grid& grid);
  void DrawClipGrid(const scene::DisplayList& list);

  GlProgram line_program_, grid_program_;
  TriangleStream<Vertex> triangles_;
  GlVertexArray empty_array_;
};

}  // namespace plumbline::display
