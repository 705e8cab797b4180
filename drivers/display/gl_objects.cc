#include "drivers/display/gl_objects.h"

#include <fmt/format.h>

namespace plumbline::display {
namespace {

constexpr const char* kShaderHead =
    "#version 300 es\n"
    "precision highp float;\nprecision highp int;\nprecision highp sampler2D;\n";

/// @return the shader, or 0 with the compiler log in `problem`
GLuint CompiledShader(GLenum kind, const std::string& source, std::string& problem) {
  const GLuint shader = glCreateShader(kind);
  const std::string whole = kShaderHead + source;
  const char* text = whole.c_str();
  glShaderSource(shader, 1, &text, nullptr);
  glCompileShader(shader);
  GLint good = GL_FALSE;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &good);
  if (good == GL_TRUE) return shader;
  char log[1000] = "";
  glGetShaderInfoLog(shader, sizeof log, nullptr, log);
  problem = fmt::format("{} shader: {}", kind == GL_VERTEX_SHADER ? "vertex" : "fragment", log);
  glDeleteShader(shader);
  return 0;
}

}  // namespace

Result<GlProgram> GlProgram::Build(const std::string& vertex, const std::string& fragment,
                                   const std::vector<const char*>& captured) {
  std::string problem;
  const GLuint vertex_shader = CompiledShader(GL_VERTEX_SHADER, vertex, problem);
  const GLuint fragment_shader =
      vertex_shader == 0 ? 0 : CompiledShader(GL_FRAGMENT_SHADER, fragment, problem);
  GlProgram program;
  GLint good = GL_FALSE;
  if (fragment_shader != 0) {
    program.name_ = glCreateProgram();
    glAttachShader(program.name_, vertex_shader);
    glAttachShader(program.name_, fragment_shader);
    if (!captured.empty()) {
      glTransformFeedbackVaryings(program.name_, static_cast<GLsizei>(captured.size()),
                                  captured.data(), GL_INTERLEAVED_ATTRIBS);
    }
    glLinkProgram(program.name_);
    glGetProgramiv(program.name_, GL_LINK_STATUS, &good);
    if (good != GL_TRUE) {
      char log[1000] = "";
      glGetProgramInfoLog(program.name_, sizeof log, nullptr, log);
      problem = fmt::format("shaders cannot be linked: {}", log);
    }
  }
  if (vertex_shader != 0) glDeleteShader(vertex_shader);
  if (fragment_shader != 0) glDeleteShader(fragment_shader);
  if (good != GL_TRUE) return Error{problem};
  return program;
}

std::string GlProblem() {
  const GLenum error = glGetError();
  if (error == GL_NO_ERROR) return "";
  // Bounded: a lost context may return errors for ever.
  for (int i = 0; i < 8 && glGetError() != GL_NO_ERROR; ++i) continue;
  if (error == GL_OUT_OF_MEMORY) return "OpenGL is out of memory";
  return fmt::format("OpenGL error 0x{:04x}", error);
}

}  // namespace plumbline::display
