// Fake V4L2 kernel interface: ioctl(), poll(), mmap() and munmap() are replaced by the linker
// (--wrap). A plain file represents each device node.
#pragma once

#include <linux/videodev2.h>

#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <vector>

#include "drivers/camera/v4l2_device.h"
#include "tests/app/temporary_folder.h"

namespace plumbline::test {

/// Simulated time, advanced by poll().
double FakeTime();
void SetFakeTime(double now_s);

struct FakeMode {
  std::uint32_t fourcc = 0;
  std::uint32_t width = 0, height = 0;
  std::vector<std::uint32_t> rates_hz;
};

struct FakeControl {
  int minimum = 0, maximum = 0, value = 0;
  int step = 1;          ///< the device rounds down to it
  bool refuses = false;  ///< rejects with EBUSY
  std::uint32_t flags = 0;
};

struct FakeFrame {
  std::vector<std::uint8_t> bytes;
  std::uint32_t flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  std::uint32_t skipped = 0;  ///< frames that the device lost before this one
  double older_s = 0;         ///< age of its time stamp [s]
};

/// Simulated device behind ioctl().
struct FakeDevice {
  std::uint32_t caps = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
  std::vector<FakeMode> modes;
  std::map<std::uint32_t, FakeControl> controls;
  std::deque<FakeFrame> coming;  ///< one arrives every 30 ms of waiting
  bool gone = false, busy = false, ignores_format = false;
  std::uint32_t padding = 0;  ///< bytes behind each row
  int opened = 0;             ///< number of STREAMON calls

  /// Delivers a frame now; lost if no buffer is free.
  void Arrive(const FakeFrame& frame);

  // What the driver under test requested.
  FakeMode set;
  struct Memory {
    std::vector<std::uint8_t> bytes;
    bool queued = false;
  };
  std::vector<Memory> memory;
  std::deque<v4l2_buffer> ready;
  std::uint32_t sequence = 0;
  bool streaming = false;
};

/// Simulated machine with cameras: /sys/class/video4linux and /dev in a temporary folder.
class FakeMachine {
 public:
  FakeMachine();
  ~FakeMachine();
  FakeMachine(const FakeMachine&) = delete;
  FakeMachine& operator=(const FakeMachine&) = delete;

  /// Plugs a USB camera into a port such as "1-2". Empty serial number: none.
  FakeDevice& Plug(int number, const std::string& port, const std::string& serial);
  void Unplug(int number);
  std::string Path(int number) const;
  camera::DeviceTree tree() const {
    return {folder_.path() + "/sys/class", folder_.path() + "/dev"};
  }

 private:
  TemporaryFolder folder_;
};

}  // namespace plumbline::test
