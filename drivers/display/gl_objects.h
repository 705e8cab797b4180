// RAII wrappers for OpenGL object names and programs of the current context.
#pragma once

#include <GLES3/gl3.h>

#include <cstddef>
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

#include "firmware-like/result.h"

namespace plumbline::display {

/// Owns one object name; generated on first use.
template <auto kGenerate, auto kDelete>
class GlName {
 public:
  GlName() = default;
  GlName(GlName&& other) noexcept : name_(std::exchange(other.name_, 0)) {}
  GlName& operator=(GlName&& other) noexcept {
    std::swap(name_, other.name_);
    return *this;
  }
  ~GlName() {
    if (name_ != 0) kDelete(1, &name_);
  }

  GLuint operator*() {
    if (name_ == 0) kGenerate(1, &name_);
    return name_;
  }

 private:
  GLuint name_ = 0;
};

using GlBuffer = GlName<glGenBuffers, glDeleteBuffers>;
using GlTexture = GlName<glGenTextures, glDeleteTextures>;
using GlVertexArray = GlName<glGenVertexArrays, glDeleteVertexArrays>;
using GlFramebuffer = GlName<glGenFramebuffers, glDeleteFramebuffers>;
using GlRenderbuffer = GlName<glGenRenderbuffers, glDeleteRenderbuffers>;

/// Vertex shader of one triangle that covers the picture; draws 3 vertices.
inline constexpr const char* kWholePictureVertex = R"(
void main() {
  vec2 corner = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
  gl_Position = vec4(corner, 0.0, 1.0);
}
)";

/// Program of a vertex and a fragment shader.
class GlProgram {
 public:
  GlProgram() = default;
  GlProgram(GlProgram&& other) noexcept : name_(std::exchange(other.name_, 0)) {}
  GlProgram& operator=(GlProgram&& other) noexcept {
    std::swap(name_, other.name_);
    return *this;
  }
  ~GlProgram() {
    if (name_ != 0) glDeleteProgram(name_);
  }

  /// Compiles and links the shaders. The sources are prefixed with "#version 300 es" and highp
  /// precision.
  /// @param captured  vertex shader outputs for transform feedback, interleaved
  /// @return          the program, or the log of the compiler or linker
  static Result<GlProgram> Build(const std::string& vertex, const std::string& fragment,
                                 const std::vector<const char*>& captured = {});

  void Use() const { glUseProgram(name_); }
  /// Location of a uniform; -1, which the setters ignore, if the shaders do not use it.
  GLint UniformLocation(const char* uniform) const { return glGetUniformLocation(name_, uniform); }

 private:
  GLuint name_ = 0;
};

/// Text of the first OpenGL error since the last call; empty if there was none.
std::string GlProblem();

// Stream of triangles that are uploaded again for every picture.

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
