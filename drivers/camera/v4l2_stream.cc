#include "drivers/camera/v4l2_stream.h"

#include <fmt/format.h>
#include <linux/videodev2.h>
#include <sys/mman.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "drivers/ioctl.h"

namespace plumbline::camera {
namespace {

constexpr std::uint32_t kMaxBuffers = 32;  // limit of the kernel

v4l2_buffer EmptyBuffer(std::uint32_t index) {
  v4l2_buffer buffer{};
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  buffer.index = index;
  return buffer;
}

Error Failed(const char* what) {
  return {fmt::format("{}: {}{}", what, std::strerror(errno),
                      errno == EBUSY ? ". Check whether another program uses the camera." : "")};
}

}  // namespace

Result<std::unique_ptr<V4l2Stream>> V4l2Stream::Start(int fd) {
  std::unique_ptr<V4l2Stream> stream(new V4l2Stream(fd));
  if (const auto mapped = stream->Map(); !mapped) return mapped.failure();
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (IoctlAgain(fd, VIDIOC_STREAMON, &type) != 0) return Failed("cannot start streaming");
  return stream;
}

Result<void> V4l2Stream::Map() {
  v4l2_requestbuffers request{};
  request.count = kBuffers;
  request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  request.memory = V4L2_MEMORY_MMAP;
  if (IoctlAgain(fd_, VIDIOC_REQBUFS, &request) != 0) return Failed("cannot request buffers");
  if (request.count < 2 || request.count > kMaxBuffers) {
    return Error{
        fmt::format("the driver provides {} buffers, at least 2 are needed", request.count)};
  }
  for (std::uint32_t i = 0; i < request.count; ++i) {
    v4l2_buffer buffer = EmptyBuffer(i);
    if (IoctlAgain(fd_, VIDIOC_QUERYBUF, &buffer) != 0) return Failed("cannot query a buffer");
    void* memory = mmap(nullptr, buffer.length, PROT_READ | PROT_WRITE, MAP_SHARED, fd_,
                        static_cast<off_t>(buffer.m.offset));
    if (memory == MAP_FAILED) return Failed("cannot map a buffer");
    buffers_.push_back({memory, buffer.length});
    if (!Requeue(i)) return Failed("cannot queue a buffer");
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

bool V4l2Stream::Requeue(std::uint32_t index) const {
  v4l2_buffer buffer = EmptyBuffer(index);
  return IoctlAgain(fd_, VIDIOC_QBUF, &buffer) == 0;
}

V4l2StreamResult V4l2Stream::TakeNewest(V4l2Frame& frame) {
  if (dequeued_ && !Requeue(*dequeued_)) return V4l2StreamResult::kGone;
  dequeued_.reset();
  bool damaged = false;
  // Bounded: a device that fills buffers faster than we dequeue would keep us here.
  for (std::size_t i = 0; i < buffers_.size(); ++i) {
    v4l2_buffer buffer = EmptyBuffer(0);
    if (IoctlAgain(fd_, VIDIOC_DQBUF, &buffer) != 0) {
      if (errno == EAGAIN) break;
      return V4l2StreamResult::kGone;
    }
    if (buffer.index >= buffers_.size()) {
      errno = EIO;
      return V4l2StreamResult::kGone;
    }
    if ((buffer.flags & V4L2_BUF_FLAG_ERROR) != 0 || buffer.bytesused == 0) {
      damaged = true;
      if (!Requeue(buffer.index)) return V4l2StreamResult::kGone;
      continue;
    }
    if (dequeued_ && !Requeue(*dequeued_)) return V4l2StreamResult::kGone;
    dequeued_ = buffer.index;
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
  if (dequeued_) return V4l2StreamResult::kFrame;
  return damaged ? V4l2StreamResult::kDamaged : V4l2StreamResult::kNotReady;
}

}  // namespace plumbline::camera
