#include "drivers/camera/v4l2_stream.h"

#include <fmt/format.h>
#include <linux/videodev2.h>
#include <sys/mman.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "drivers/ioctl.h"

namespace plumbline {
namespace {

constexpr std::uint32_t kMostBuffers = 32;  // the kernel's own limit

v4l2_buffer EmptyBuffer(std::uint32_t index) {
  v4l2_buffer buffer{};
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  buffer.index = index;
  return buffer;
}

Error Failed(const char* what) {
  return {fmt::format("{}: {}{}", what, std::strerror(errno),
                      errno == EBUSY ? "; does another program use the camera?" : "")};
}

}  // namespace

Result<std::unique_ptr<V4l2Stream>> V4l2Stream::Start(int fd) {
  std::unique_ptr<V4l2Stream> stream(new V4l2Stream(fd));
  if (const auto mapped = stream->Map(); !mapped) return mapped.failure();
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (IoctlAgain(fd, VIDIOC_STREAMON, &type) != 0) return Failed("cannot begin to stream");
  return stream;
}

Result<void> V4l2Stream::Map() {
  v4l2_requestbuffers request{};
  request.count = kBuffers;
  request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  request.memory = V4L2_MEMORY_MMAP;
  if (IoctlAgain(fd_, VIDIOC_REQBUFS, &request) != 0) return Failed("no buffers to share");
  if (request.count < 2 || request.count > kMostBuffers) {
    return Error{fmt::format("{} buffers to share, 2 are needed", request.count)};
  }
  for (std::uint32_t i = 0; i < request.count; ++i) {
    v4l2_buffer buffer = EmptyBuffer(i);
    if (IoctlAgain(fd_, VIDIOC_QUERYBUF, &buffer) != 0) return Failed("a buffer is not told");
    void* memory = mmap(nullptr, buffer.length, PROT_READ | PROT_WRITE, MAP_SHARED, fd_,
                        static_cast<off_t>(buffer.m.offset));
    if (memory == MAP_FAILED) return Failed("a buffer cannot be shared");
    buffers_.push_back({memory, buffer.length});
    if (!GiveBack(i)) return Failed("a buffer is not taken");
  }
  return {};
}

V4l2Stream::~V4l2Stream() {
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  IoctlAgain(fd_, VIDIOC_STREAMOFF, &type);
  for (const Buffer& buffer : buffers_) munmap(buffer.memory, buffer.size);
  v4l2_requestbuffers none{};
  none.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  none.memory = V4L2_MEMORY_MMAP;
  IoctlAgain(fd_, VIDIOC_REQBUFS, &none);
}

bool V4l2Stream::GiveBack(std::uint32_t index) const {
  v4l2_buffer buffer = EmptyBuffer(index);
  return IoctlAgain(fd_, VIDIOC_QBUF, &buffer) == 0;
}

V4l2Answer V4l2Stream::TakeNewest(V4l2Frame& frame) {
  if (held_ && !GiveBack(*held_)) return V4l2Answer::kGone;
  held_.reset();
  bool damaged = false;
  // At most as many as there are: a device that fills faster than we look would keep us here.
  for (std::size_t i = 0; i < buffers_.size(); ++i) {
    v4l2_buffer buffer = EmptyBuffer(0);
    if (IoctlAgain(fd_, VIDIOC_DQBUF, &buffer) != 0) {
      if (errno == EAGAIN) break;
      return V4l2Answer::kGone;
    }
    if (buffer.index >= buffers_.size()) {
      errno = EIO;
      return V4l2Answer::kGone;
    }
    if ((buffer.flags & V4L2_BUF_FLAG_ERROR) != 0 || buffer.bytesused == 0) {
      damaged = true;
      if (!GiveBack(buffer.index)) return V4l2Answer::kGone;
      continue;
    }
    if (held_ && !GiveBack(*held_)) return V4l2Answer::kGone;
    held_ = buffer.index;
    const Buffer& shared = buffers_[buffer.index];
    frame.bytes = {static_cast<const std::uint8_t*>(shared.memory),
                   std::min<std::size_t>(buffer.bytesused, shared.size)};
    frame.sequence = buffer.sequence;
    frame.time_s.reset();
    if ((buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC) {
      frame.time_s = static_cast<double>(buffer.timestamp.tv_sec) +
                     1e-6 * static_cast<double>(buffer.timestamp.tv_usec);
    }
  }
  if (held_) return V4l2Answer::kFrame;
  return damaged ? V4l2Answer::kDamaged : V4l2Answer::kNothing;
}

}  // namespace plumbline
