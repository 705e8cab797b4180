// Fake kernel interface of a graphics card with one monitor, and of a framebuffer: replaces ioctl()
// and mmap() for the files that it creates. libdrm is the real one.
#pragma once

#include <linux/fb.h>
#include <sys/types.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "firmware-like/image/image_size.h"
#include "firmware-like/lens/lens.h"

namespace plumbline::test {

/// Fake card with the connector HDMI-A-1. At most one at a time.
class FakeCard {
 public:
  FakeCard();
  ~FakeCard();
  FakeCard(const FakeCard&) = delete;
  FakeCard& operator=(const FakeCard&) = delete;

  std::string path;  ///< path to open

  // Set by the test.
  bool atomic = true;
  bool connected = true;
  std::vector<image::ImageSize> modes = {{1280, 720}, {640, 480}};  ///< the first one is preferred
  int refuse_commits_with = 0;                                      ///< errno

  std::function<void()> on_commit,
      on_flip;  ///< called when a picture is accepted and when it is shown

  /// Simulates a refresh: the committed picture is on the screen and its event is sent. May be
  /// called from another thread than the one that draws.
  void Refresh();

  // Queried by the test.
  int probes() const { return probes_; }           ///< number of connector probes
  image::ImageSize mode() const { return mode_; }  ///< {0, 0}: never set
  int modes_set() const { return modes_set_; }     ///< number of mode sets
  std::size_t buffers() const { return buffers_.size(); }
  /// Pixel on the screen: 0xXXRRGGBB.
  std::uint32_t Pixel(int u, int v) const;

  // Called by the fake kernel interface.
  int Ioctl(unsigned long request, void* argument);
  int MemoryAt(off_t offset) const;
  bool Owns(int fd) const;

 private:
  struct Buffer {
    int memory = -1;  ///< a memfd
    std::uint32_t width = 0, height = 0;
  };
  int Commit(const void* request);
  int Answer(unsigned long request, void* argument);

  std::mutex mutex_;  ///< guards the state shared by both threads
  ino_t inode_ = 0;
  int events_ = -1;
  std::uint32_t next_ = 1000;
  std::map<std::uint32_t, Buffer> buffers_;              ///< by handle
  std::map<std::uint32_t, std::uint32_t> framebuffers_;  ///< handle by framebuffer id
  std::map<std::uint32_t, image::ImageSize> blobs_;
  std::uint32_t on_screen_ = 0, pending_ = 0;  ///< framebuffers
  std::uint64_t pending_user_ = 0;
  image::ImageSize mode_;
  int modes_set_ = 0, probes_ = 0;
};

/// File that holds the pixels of a framebuffer.
class FakeFramebuffer {
 public:
  FakeFramebuffer(const fb_var_screeninfo& var, std::size_t stride, std::size_t bytes);
  ~FakeFramebuffer();
  FakeFramebuffer(const FakeFramebuffer&) = delete;
  FakeFramebuffer& operator=(const FakeFramebuffer&) = delete;

  std::string path;
  fb_var_screeninfo var;
  fb_fix_screeninfo fix{};
  bool gone = false;

  std::vector<std::uint8_t> Bytes() const;
  int Ioctl(unsigned long request, void* argument) const;
  bool Owns(int fd) const;

 private:
  ino_t inode_ = 0;
};

}  // namespace plumbline::test
