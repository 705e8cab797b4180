#include "drivers/display/gl_context.h"

#define EGL_EGLEXT_PROTOTYPES 0
#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <GLES3/gl3.h>
#include <fmt/format.h>

#include <array>
#include <string_view>

namespace plumbline::display {
namespace {

/// Searches a space-separated list of extensions.
bool ListsWord(const std::string& list, const std::string& word) {
  return (' ' + list + ' ').find(' ' + word + ' ') != std::string::npos;
}

std::string TextOrEmpty(const void* text) {
  return text == nullptr ? "" : static_cast<const char*>(text);
}

/// Casts the untyped pointer of eglGetProcAddress().
template <typename Function>
Function EglFunction(const char* name) {
  return reinterpret_cast<Function>(eglGetProcAddress(name));
}

std::string EglProblem(const char* what) {
  return fmt::format("{}: EGL error 0x{:04x}", what, static_cast<unsigned>(eglGetError()));
}

}  // namespace

bool GlContext::Has(const std::string& egl_extension) const {
  return ListsWord(egl_extensions_, egl_extension);
}

Result<std::unique_ptr<GlContext>> GlContext::Create() {
  const std::string client = TextOrEmpty(eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS));
  const auto platform_display =
      EglFunction<PFNEGLGETPLATFORMDISPLAYEXTPROC>("eglGetPlatformDisplayEXT");
  if (platform_display == nullptr || !ListsWord(client, "EGL_EXT_platform_base")) {
    return Error{
        "EGL has no platforms on this computer. Install libegl-mesa0 and libgl1-mesa-dri."};
  }
  std::unique_ptr<GlContext> context(new GlContext);
  std::string problems;
  if (ListsWord(client, "EGL_MESA_platform_surfaceless")) {
    const std::string problem = context->TryDisplay(
        platform_display(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr));
    if (problem.empty()) return context;
    problems += fmt::format("surfaceless: {}; ", problem);
  }
  const auto query_devices = EglFunction<PFNEGLQUERYDEVICESEXTPROC>("eglQueryDevicesEXT");
  if (query_devices != nullptr && ListsWord(client, "EGL_EXT_platform_device")) {
    std::array<EGLDeviceEXT, 16> devices{};
    EGLint count = 0;
    query_devices(static_cast<EGLint>(devices.size()), devices.data(), &count);
    for (int i = 0; i < count; ++i) {
      const std::string problem = context->TryDisplay(
          platform_display(EGL_PLATFORM_DEVICE_EXT, devices[static_cast<std::size_t>(i)], nullptr));
      if (problem.empty()) return context;
      problems += fmt::format("device {}: {}; ", i, problem);
    }
  }
  return Error{fmt::format(
      "no off-screen OpenGL ES 3 context: {}check that libgl1-mesa-dri is installed", problems)};
}

/// Creates the context on an EGL display. @return why that failed; empty: success
std::string GlContext::TryDisplay(void* display) {
  if (display == EGL_NO_DISPLAY || eglInitialize(display, nullptr, nullptr) == EGL_FALSE) {
    return EglProblem("no display");
  }
  display_ = display;
  egl_extensions_ = TextOrEmpty(eglQueryString(display, EGL_EXTENSIONS));
  if (!Has("EGL_KHR_surfaceless_context")) return "EGL_KHR_surfaceless_context is missing";
  if (!Has("EGL_KHR_no_config_context")) return "EGL_KHR_no_config_context is missing";
  eglBindAPI(EGL_OPENGL_ES_API);
  const std::array<EGLint, 7> robust = {EGL_CONTEXT_MAJOR_VERSION,
                                        3,
                                        EGL_CONTEXT_OPENGL_RESET_NOTIFICATION_STRATEGY_EXT,
                                        EGL_LOSE_CONTEXT_ON_RESET_EXT,
                                        EGL_CONTEXT_OPENGL_ROBUST_ACCESS_EXT,
                                        EGL_TRUE,
                                        EGL_NONE};
  const std::array<EGLint, 3> plain = {EGL_CONTEXT_MAJOR_VERSION, 3, EGL_NONE};
  EGLContext context = EGL_NO_CONTEXT;
  bool reports_resets = Has("EGL_EXT_create_context_robustness");
  if (reports_resets) {
    context = eglCreateContext(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, robust.data());
  }
  if (context == EGL_NO_CONTEXT) {
    reports_resets = false;
    context = eglCreateContext(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, plain.data());
  }
  if (context == EGL_NO_CONTEXT) return EglProblem("no OpenGL ES 3 context");
  if (eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context) == EGL_FALSE) {
    std::string problem = EglProblem("the context cannot be used");
    eglDestroyContext(display, context);
    return problem;
  }
  context_ = context;
  if (reports_resets) {
    for (const char* name : {"glGetGraphicsResetStatusKHR", "glGetGraphicsResetStatusEXT"}) {
      if (reset_status_ == nullptr) reset_status_ = EglFunction<unsigned (*)()>(name);
    }
  }
  description_ = fmt::format("{}, {}", TextOrEmpty(glGetString(GL_RENDERER)),
                             TextOrEmpty(glGetString(GL_VERSION)));
  return "";
}

GlContext::~GlContext() {
  if (context_ == nullptr) return;
  eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  eglDestroyContext(display_, context_);  // the EGL display stays initialised for the next context
}

bool GlContext::Lost() {
  // The driver reports a reset only once: the next query may return "no error".
  if (!lost_ && reset_status_ != nullptr) lost_ = reset_status_() != GL_NO_ERROR;
  return lost_;
}

}  // namespace plumbline::display
