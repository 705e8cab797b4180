// Simulates GPU resets and a missing EGL by replacing EGL entry points through the linker (link
// with -Wl,--wrap=eglGetProcAddress). Include from one source file per test.
#pragma once

#include <EGL/egl.h>

#include <cstring>

namespace plumbline::test {

inline constexpr unsigned kGuiltyContextReset = 0x8253;  // GL_GUILTY_CONTEXT_RESET

inline bool no_platforms = false;
inline unsigned reset_status = 0;  ///< reported once, as some drivers do

inline unsigned ResetStatus() {
  const unsigned status = reset_status;
  reset_status = 0;
  return status;
}

}  // namespace plumbline::test

extern "C" __eglMustCastToProperFunctionPointerType __real_eglGetProcAddress(const char* name);
extern "C" __eglMustCastToProperFunctionPointerType __wrap_eglGetProcAddress(const char* name) {
  if (plumbline::test::no_platforms) return nullptr;
  if (std::strncmp(name, "glGetGraphicsResetStatus", 24) == 0) {
    return reinterpret_cast<__eglMustCastToProperFunctionPointerType>(plumbline::test::ResetStatus);
  }
  return __real_eglGetProcAddress(name);
}
