// Render pass for lines of constant pixel width and for the grid in the clip plane.
#pragma once

#include "drivers/display/gl_objects.h"
#include "drivers/display/triangle_stream.h"
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

 private:
  struct Vertex {
    float x, y, z;                  ///< pixel centres at integers; z is depth, -1..1
    float along, across, length;    ///< position within the segment [px]
    float start, half_width, dash;  ///< start along the line [px]; dash 0: solid
    float r, g, b, a;
  };

  void AddLine(const scene::DisplayList& list, const scene::DrawnLine& line);
  void DrawLines(const scene::DisplayList& list);
  void DrawGrid(const scene::DisplayList& list);

  GlProgram line_program_, grid_program_;
  TriangleStream<Vertex> triangles_;
  GlVertexArray empty_array_;
};

}  // namespace plumbline::display
