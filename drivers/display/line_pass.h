// Lines of a width in pixels, and the grid in a clip plane.
#pragma once

#include <vector>

#include "drivers/display/gl_objects.h"
#include "firmware-like/scene/display_list.h"

namespace plumbline {

/// Each piece is a rectangle with round ends around it, smooth at its edges; dashes run on from
/// piece to piece. A line on a surface is seen: it counts as 1/1000 nearer than it is. Pieces
/// behind the camera or beyond the clip plane are cut off.
///
/// The grid of the clip plane has a line every 0.1 m and a stronger one every 1 m, counted from the
/// foot of the plane's normal through C's origin; one direction of it is C's x as seen in the
/// plane.
class LinePass {
 public:
  static Result<LinePass> Create();

  /// Over what the meshes left in the depth buffer.
  void Draw(const DisplayList& list);

 private:
  struct Vertex {
    float x, y, z;                  ///< pixel centre (0, 0); z as in the depth buffer, -1..1
    float along, across, length;    ///< in the piece [px]
    float start, half_width, dash;  ///< of the piece along the line; [px]; 0: no dashes
    float r, g, b, a;
  };

  void AddLine(const DisplayList& list, const DrawnLine& line);
  void DrawVertices(const DisplayList& list);
  void DrawGrid(const DisplayList& list);

  GlProgram line_program_, grid_program_;
  GlVertexArray array_, nothing_;
  GlBuffer buffer_;
  std::vector<Vertex> vertices_;  ///< kept for its memory
};

}  // namespace plumbline
