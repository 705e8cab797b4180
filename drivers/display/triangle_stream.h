// Stream of triangles that are uploaded again for every picture.
#pragma once

#include <GLES3/gl3.h>

#include <cstddef>
#include <initializer_list>
#include <vector>

#include "drivers/display/gl_objects.h"

namespace plumbline::display {

/// Owns the vertices, whose memory is reused from picture to picture, and their GL buffer. Every
/// three vertices form a triangle.
/// @tparam Vertex  a struct of floats
template <typename Vertex>
class TriangleStream {
 public:
  /// Floats of a vertex that form one attribute of the shader.
  struct Attribute {
    GLint floats;
    std::size_t offset;  ///< offsetof() the first
  };

  /// Assigns the attributes to the shader locations 0, 1, 2...; once, before drawing.
  void Describe(std::initializer_list<Attribute> attributes) {
    glBindVertexArray(*array_);
    glBindBuffer(GL_ARRAY_BUFFER, *buffer_);
    GLuint location = 0;
    for (const Attribute& attribute : attributes) {
      glVertexAttribPointer(location, attribute.floats, GL_FLOAT, GL_FALSE, sizeof(Vertex),
                            reinterpret_cast<const void*>(attribute.offset));
      glEnableVertexAttribArray(location++);
    }
    glBindVertexArray(0);
  }

  bool empty() const { return vertices_.empty(); }
  void Clear() { vertices_.clear(); }
  void Add(const Vertex& vertex) { vertices_.push_back(vertex); }

  /// Uploads the vertices and draws them with the program in use.
  void Draw() {
    glBindVertexArray(*array_);
    glBindBuffer(GL_ARRAY_BUFFER, *buffer_);
    glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(vertices_.size() * sizeof(Vertex)),
                 vertices_.data(), GL_STREAM_DRAW);
    glDrawArrays(GL_TRIANGLES, 0, static_cast<GLsizei>(vertices_.size()));
    glBindVertexArray(0);
  }

 private:
  GlVertexArray array_;
  GlBuffer buffer_;
  std::vector<Vertex> vertices_;
};

}  // namespace plumbline::display
