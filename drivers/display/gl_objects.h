// Names of OpenGL objects that delete themselves, and programs. Of the current context.
#pragma once

#include <GLES3/gl3.h>

#include <string>
#include <utility>
#include <vector>

#include "firmware-like/result.h"

namespace plumbline {

/// One name of a kind of object; made when it is asked for first.
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

/// A vertex and a fragment shader.
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

  /// @param sources   without their first lines: "#version 300 es", then highp for all
  /// @param captured  outputs of the vertex shader that transform feedback writes, one after the
  ///                  other
  /// @return  or the compiler's words
  static Result<GlProgram> Build(const std::string& vertex, const std::string& fragment,
                                 const std::vector<const char*>& captured = {});

  void Use() const { glUseProgram(name_); }
  /// Of a uniform; -1, which the setters pass over, where the shaders do not use it.
  GLint At(const char* uniform) const { return glGetUniformLocation(name_, uniform); }

 private:
  GLuint name_ = 0;
};

/// The first error that OpenGL has noted since the last call, in words; empty: none.
std::string GlProblem();

}  // namespace plumbline
