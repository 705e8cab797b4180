// Reporting of GPU resets and of a missing EGL.
#include <catch2/catch.hpp>

#include "drivers/display/gl_context.h"
#include "tests/drivers/display/drawing_fixture.h"
#include "tests/drivers/display/exchanged_egl.h"

namespace plumbline::context_test {

using namespace plumbline::display;

TEST_CASE("a GPU reset is reported by Draw(), and a new context and renderer work") {
  const scene::DisplayList list = test::EmptyList({64, 48});
  {
    test::Drawing drawing;
    if (!drawing.renderer) return;
    if (!drawing.context->reports_resets()) {
      std::puts("SKIPPED: this driver does not report resets");
      return;
    }
    CHECK(drawing.renderer->Draw(list) == DrawResult::kDrawn);
    test::reset_status = test::kGuiltyContextReset;
    CHECK(drawing.renderer->Draw(list) == DrawResult::kContextLost);
    CHECK(drawing.renderer->problem().find("was reset") != std::string::npos);
    CHECK(drawing.renderer->Draw(list) == DrawResult::kContextLost);
  }
  test::Drawing again;
  CHECK(again.renderer->Draw(list) == DrawResult::kDrawn);
}

TEST_CASE("without EGL's platforms the reason names the packages") {
  test::no_platforms = true;
  const auto context = GlContext::Create();
  test::no_platforms = false;
  REQUIRE_FALSE(context.ok());
  CHECK(context.error().find("libgl1-mesa-dri") != std::string::npos);
}

}  // namespace plumbline::context_test
