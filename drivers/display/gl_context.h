// An OpenGL ES 3 context without a window: on a GPU where there is one, else on the processor.
#pragma once

#include <memory>
#include <string>

#include "firmware-like/result.h"

namespace plumbline {

/// Made current to the thread that creates it, which is the only one to use it. Drawing goes to
/// framebuffer objects; what displays show is taken from there. At most one at a time: the EGL
/// display behind it is the process's.
class GlContext {
 public:
  /// Tries Mesa's surfaceless platform, then the devices of EGL_EXT_platform_device.
  /// @return or what EGL lacks on this computer, and which package brings it
  static Result<std::unique_ptr<GlContext>> Create();
  ~GlContext();
  GlContext(const GlContext&) = delete;
  GlContext& operator=(const GlContext&) = delete;

  /// True where the GPU was reset and everything in it is gone: destroy what was drawn with, then
  /// this, and make both anew. Always false where the driver cannot tell (no robustness extension).
  bool Lost();

  /// "llvmpipe (LLVM 15.0.6, 256 bits), OpenGL ES 3.2 Mesa 22.3.6".
  const std::string& description() const { return description_; }
  bool tells_resets() const { return reset_status_ != nullptr; }
  /// Whether the EGL display has an extension, by its whole name.
  bool Has(const std::string& egl_extension) const;
  void* egl_display() const { return display_; }

 private:
  GlContext() = default;
  std::string TryDisplay(void* display);

  void* display_ = nullptr;  ///< EGLDisplay
  void* context_ = nullptr;  ///< EGLContext
  unsigned (*reset_status_)() = nullptr;
  bool lost_ = false;
  std::string egl_extensions_, description_;
};

}  // namespace plumbline
