// DRM dumb buffer: scan-out memory that every card provides, with or without a GPU.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "drivers/display/pixel_packing.h"
#include "firmware-like/image/image_size.h"
#include "firmware-like/result.h"

namespace plumbline::display {

/// XRGB, 32 bits per pixel, mapped for writing.
class DumbBuffer {
 public:
  /// @param card  open card; must outlive the buffer
  static Result<std::unique_ptr<DumbBuffer>> Make(int card, image::ImageSize size);
  ~DumbBuffer();
  DumbBuffer(const DumbBuffer&) = delete;
  DumbBuffer& operator=(const DumbBuffer&) = delete;

  void Fill(DrawnPicture& picture) { PackDrawn(picture, layout_, {memory_, bytes_}); }
  std::uint32_t framebuffer() const { return framebuffer_; }

 private:
  explicit DumbBuffer(int card) : card_(card) {}

  const int card_;
  PixelLayout layout_;
  std::uint32_t handle_ = 0, framebuffer_ = 0;
  std::uint8_t* memory_ = nullptr;
  std::size_t bytes_ = 0;
};

}  // namespace plumbline::display
