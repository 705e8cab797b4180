#include "drivers/display/dumb_buffer.h"

#include <drm_fourcc.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <xf86drm.h>
#include <xf86drmMode.h>

#include <cerrno>
#include <cstring>

namespace plumbline::display {

Result<std::unique_ptr<DumbBuffer>> DumbBuffer::Make(int card, image::ImageSize size) {
  std::unique_ptr<DumbBuffer> buffer(new DumbBuffer(card));
  const auto failed = [](const char* what) {
    return Error{
        fmt::format("cannot allocate a scan-out buffer ({}): {}", what, std::strerror(errno))};
  };
  drm_mode_create_dumb made{};
  made.width = static_cast<std::uint32_t>(size.width);
  made.height = static_cast<std::uint32_t>(size.height);
  made.bpp = 32;
  if (drmIoctl(card, DRM_IOCTL_MODE_CREATE_DUMB, &made) != 0) return failed("create");
  buffer->handle_ = made.handle;
  buffer->bytes_ = made.size;
  buffer->layout_ = {.size = size, .stride = made.pitch};
  if (const Result<void> valid = CheckLayout(buffer->layout_, made.size); !valid) {
    return Error{"the card provides a buffer with " + valid.error()};
  }
  const std::uint32_t handles[4] = {made.handle}, strides[4] = {made.pitch}, offsets[4] = {};
  if (drmModeAddFB2(card, made.width, made.height, DRM_FORMAT_XRGB8888, handles, strides, offsets,
                    &buffer->framebuffer_, 0) != 0) {
    return failed("framebuffer");
  }
  drm_mode_map_dumb mapped{};
  mapped.handle = made.handle;
  if (drmIoctl(card, DRM_IOCTL_MODE_MAP_DUMB, &mapped) != 0) return failed("map");
  void* memory = mmap(nullptr, made.size, PROT_READ | PROT_WRITE, MAP_SHARED, card,
                      static_cast<off_t>(mapped.offset));
  if (memory == MAP_FAILED) return failed("mmap");
  buffer->memory_ = static_cast<std::uint8_t*>(memory);
  return buffer;
}

DumbBuffer::~DumbBuffer() {
  if (memory_ != nullptr) munmap(memory_, bytes_);
  if (framebuffer_ != 0) drmModeRmFB(card_, framebuffer_);
  if (handle_ == 0) return;
  drm_mode_destroy_dumb gone{};
  gone.handle = handle_;
  drmIoctl(card_, DRM_IOCTL_MODE_DESTROY_DUMB, &gone);
}

}  // namespace plumbline::display
