// What the owner is told where the GPU is reset, and where there is no EGL: EGL's answers are
// exchanged by the linker (--wrap), since neither can be had for the asking.
#include <EGL/egl.h>

#include <catch2/catch.hpp>
#include <cstring>

#include "drivers/display/gl_context.h"
#include "tests/drivers/display/drawing.h"

using namespace plumbline;

namespace {

bool no_platforms = false;
unsigned reset_status = GL_NO_ERROR;

unsigned ResetStatus() {
  const unsigned status = reset_status;
  reset_status = GL_NO_ERROR;  // told once, as drivers may do it
  return status;
}

}  // namespace

extern "C" __eglMustCastToProperFunctionPointerType __real_eglGetProcAddress(const char* name);
extern "C" __eglMustCastToProperFunctionPointerType __wrap_eglGetProcAddress(const char* name) {
  if (no_platforms) return nullptr;
  if (std::strncmp(name, "glGetGraphicsResetStatus", 24) == 0) {
    return reinterpret_cast<__eglMustCastToProperFunctionPointerType>(ResetStatus);
  }
  return __real_eglGetProcAddress(name);
}

TEST_CASE("a reset of the GPU is told by Draw(), and context and renderer made anew go on") {
  const DisplayList list = test::EmptyList({64, 48});
  {
    test::Drawing drawing;
    if (!drawing.renderer) return;
    if (!drawing.context->tells_resets()) {
      std::puts("SKIPPED: this driver tells no resets");
      return;
    }
    CHECK(drawing.renderer->Draw(list) == DrawResult::kDrawn);
    reset_status = 0x8253;  // GL_GUILTY_CONTEXT_RESET
    CHECK(drawing.renderer->Draw(list) == DrawResult::kContextLost);
    CHECK(drawing.renderer->problem().find("was reset") != std::string::npos);
    CHECK(drawing.renderer->Draw(list) == DrawResult::kContextLost);
  }
  test::Drawing again;
  CHECK(again.renderer->Draw(list) == DrawResult::kDrawn);
}

TEST_CASE("without EGL's platforms the reason names the packages") {
  no_platforms = true;
  const auto context = GlContext::Create();
  no_platforms = false;
  REQUIRE_FALSE(context.ok());
  CHECK(context.error().find("libgl1-mesa-dri") != std::string::npos);
}
