// Off-screen OpenGL ES 3 context, on a GPU if there is one, otherwise in software.
#pragma once

#include <memory>
#include <string>

#include "firmware-like/result.h"

namespace plumbline::display {

/// Current on the thread that creates it, which is the only one that may use it. Everything is
/// drawn into framebuffer objects. At most one context at a time, because the EGL display is shared
/// by the process.
class GlContext {
 public:
  /// Tries Mesa's surfaceless platform, then the devices of EGL_EXT_platform_device.
  /// @return the context, or what EGL lacks on this computer and which package provides it
  static Result<std::unique_ptr<GlContext>> Create();
  ~GlContext();
  GlContext(const GlContext&) = delete;
  GlContext& operator=(const GlContext&) = delete;

  /// True if the GPU was reset and all its objects are lost: destroy the renderer, then this
  /// context, and create both again. Always false if the driver cannot report resets (no robustness
  /// extension).
  bool Lost();

  /// "llvmpipe (LLVM 15.0.6, 256 bits), OpenGL ES 3.2 Mesa 22.3.6".
  const std::string& description() const { return description_; }
  /// True if the driver reports GPU resets.
  bool reports_resets() const { return reset_status_ != nullptr; }
  /// True if the EGL display supports the extension.
  bool Has(const std::string& egl_extension) const;

 private:
  GlContext() = default;
  std::string TryDisplay(void* display);

  void* display_ = nullptr;  ///< EGLDisplay
  void* context_ = nullptr;  ///< EGLContext
  unsigned (*reset_status_)() = nullptr;
  bool lost_ = false;
  std::string egl_extensions_, description_;
};

}  // namespace plumbline::display
