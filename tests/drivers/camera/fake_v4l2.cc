#include "tests/drivers/camera/fake_v4l2.h"

#include <poll.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdarg>
#include <filesystem>
#include <fstream>
#include <memory>
#include <set>
#include <string_view>

namespace fs = std::filesystem;

namespace plumbline::test {
namespace {

double now_s = 0;
std::map<std::string, std::unique_ptr<FakeDevice>>& Devices() {
  static std::map<std::string, std::unique_ptr<FakeDevice>> devices;
  return devices;
}

/// Currently mapped fake buffers, excluding the process's own mappings.
std::set<void*>& Shared() {
  static std::set<void*> shared;
  return shared;
}

/// Device behind a descriptor; nullptr for any other file.
FakeDevice* DeviceOf(int fd) {
  char target[4096];
  const std::string link = "/proc/self/fd/" + std::to_string(fd);
  const ssize_t length = readlink(link.c_str(), target, sizeof target);
  if (length <= 0) return nullptr;
  std::string path(target, static_cast<std::size_t>(length));
  // A removed node: open descriptors still refer to the device that is gone.
  path = path.substr(0, path.find(" (deleted)"));
  const auto found = Devices().find(path);
  return found == Devices().end() ? nullptr : found->second.get();
}

int Refuse(int error) {
  errno = error;
  return -1;
}

std::uint32_t RowBytes(const FakeMode& mode, std::uint32_t padding) {
  if (mode.fourcc == V4L2_PIX_FMT_MJPEG) return 0;
  const bool packed = mode.fourcc == V4L2_PIX_FMT_YUYV || mode.fourcc == V4L2_PIX_FMT_UYVY;
  return (packed ? 2 * mode.width : mode.width) + padding;
}

int SetFormat(FakeDevice& device, v4l2_format& format) {
  if (device.busy) return Refuse(EBUSY);
  const v4l2_pix_format requested = format.fmt.pix;
  device.set = device.modes.front();
  for (const FakeMode& mode : device.modes) {
    if (!device.ignores_format && mode.fourcc == requested.pixelformat &&
        mode.width == requested.width && mode.height == requested.height) {
      device.set = mode;
    }
  }
  v4l2_pix_format& pix = format.fmt.pix;
  pix = {};
  pix.width = device.set.width;
  pix.height = device.set.height;
  pix.pixelformat = device.set.fourcc;
  pix.field = V4L2_FIELD_NONE;
  pix.bytesperline = RowBytes(device.set, device.padding);
  pix.sizeimage = 4 * (device.set.width + device.padding) * device.set.height;
  return 0;
}

int Enumerate(const FakeDevice& device, unsigned long request, void* argument) {
  if (request == VIDIOC_ENUM_FMT) {
    auto& format = *static_cast<v4l2_fmtdesc*>(argument);
    std::vector<std::uint32_t> kinds;
    for (const FakeMode& mode : device.modes) {
      if (std::find(kinds.begin(), kinds.end(), mode.fourcc) == kinds.end())
        kinds.push_back(mode.fourcc);
    }
    if (format.index >= kinds.size()) return Refuse(EINVAL);
    format.pixelformat = kinds[format.index];
    return 0;
  }
  if (request == VIDIOC_ENUM_FRAMESIZES) {
    auto& size = *static_cast<v4l2_frmsizeenum*>(argument);
    std::uint32_t index = 0;
    for (const FakeMode& mode : device.modes) {
      if (mode.fourcc != size.pixel_format || index++ != size.index) continue;
      size.type = V4L2_FRMSIZE_TYPE_DISCRETE;
      size.discrete = {mode.width, mode.height};
      return 0;
    }
    return Refuse(EINVAL);
  }
  auto& interval = *static_cast<v4l2_frmivalenum*>(argument);
  for (const FakeMode& mode : device.modes) {
    if (mode.fourcc != interval.pixel_format || mode.width != interval.width ||
        mode.height != interval.height)
      continue;
    if (interval.index >= mode.rates_hz.size()) return Refuse(EINVAL);
    interval.type = V4L2_FRMIVAL_TYPE_DISCRETE;
    interval.discrete = {1, mode.rates_hz[interval.index]};
    return 0;
  }
  return Refuse(EINVAL);
}

int Control(FakeDevice& device, unsigned long request, void* argument) {
  const std::uint32_t id = request == VIDIOC_QUERYCTRL ? static_cast<v4l2_queryctrl*>(argument)->id
                                                       : static_cast<v4l2_control*>(argument)->id;
  const auto found = device.controls.find(id);
  if (found == device.controls.end()) return Refuse(EINVAL);
  FakeControl& control = found->second;
  if (request == VIDIOC_QUERYCTRL) {
    auto& query = *static_cast<v4l2_queryctrl*>(argument);
    query.minimum = control.minimum;
    query.maximum = control.maximum;
    query.default_value = control.minimum;
    query.flags = control.flags;
    return 0;
  }
  auto& value = *static_cast<v4l2_control*>(argument);
  if (request == VIDIOC_G_CTRL) {
    value.value = control.value;
    return 0;
  }
  if (control.refuses) return Refuse(EBUSY);
  control.value = value.value - value.value % control.step;
  return 0;
}

int Buffers(FakeDevice& device, unsigned long request, void* argument) {
  if (request == VIDIOC_REQBUFS) {
    auto& wanted = *static_cast<v4l2_requestbuffers*>(argument);
    device.ready.clear();
    device.memory.assign(wanted.count, {});
    for (auto& one : device.memory)
      one.bytes.resize(4 * std::size_t{device.set.width + device.padding} * device.set.height);
    return 0;
  }
  if (request == VIDIOC_STREAMON || request == VIDIOC_STREAMOFF) {
    device.streaming = request == VIDIOC_STREAMON;
    if (device.streaming) ++device.opened;
    device.sequence = 0;
    return 0;
  }
  auto& buffer = *static_cast<v4l2_buffer*>(argument);
  if (request == VIDIOC_DQBUF) {
    if (device.ready.empty()) return Refuse(EAGAIN);
    buffer = device.ready.front();
    device.ready.pop_front();
    return 0;
  }
  if (buffer.index >= device.memory.size()) return Refuse(EINVAL);
  auto& memory = device.memory[buffer.index];
  if (request == VIDIOC_QUERYBUF) {
    buffer.length = static_cast<std::uint32_t>(memory.bytes.size());
    buffer.m.offset = buffer.index * 4096;
    return 0;
  }
  if (memory.queued) return Refuse(EINVAL);
  memory.queued = true;
  return 0;
}

/// Copies text into a zero-filled field.
void Put(std::string_view text, unsigned char* field) {
  std::copy(text.begin(), text.end(), field);
}

int Answer(FakeDevice& device, unsigned long request, void* argument) {
  if (device.gone) return Refuse(ENODEV);
  switch (request) {
    case VIDIOC_QUERYCAP: {
      auto& capability = *static_cast<v4l2_capability*>(argument);
      capability = {};
      Put("fake", capability.driver);
      Put("Fake camera", capability.card);
      Put("fake-bus", capability.bus_info);
      capability.capabilities = device.caps | V4L2_CAP_DEVICE_CAPS;
      capability.device_caps = device.caps;
      return 0;
    }
    case VIDIOC_S_FMT:
      return SetFormat(device, *static_cast<v4l2_format*>(argument));
    case VIDIOC_S_PARM:
      return 0;  // accepts the requested rate
    case VIDIOC_ENUM_FMT:
    case VIDIOC_ENUM_FRAMESIZES:
    case VIDIOC_ENUM_FRAMEINTERVALS:
      return Enumerate(device, request, argument);
    case VIDIOC_QUERYCTRL:
    case VIDIOC_G_CTRL:
    case VIDIOC_S_CTRL:
      return Control(device, request, argument);
    case VIDIOC_REQBUFS:
    case VIDIOC_STREAMON:
    case VIDIOC_STREAMOFF:
    case VIDIOC_DQBUF:
    case VIDIOC_QUERYBUF:
    case VIDIOC_QBUF:
      return Buffers(device, request, argument);
    default:
      return Refuse(ENOTTY);
  }
}

}  // namespace

double FakeTime() {
  return now_s;
}

void SetFakeTime(double time_s) {
  now_s = time_s;
}

void FakeDevice::Arrive(const FakeFrame& frame) {
  if (!streaming) return;
  sequence += frame.skipped;
  v4l2_buffer buffer{};
  buffer.sequence = sequence++;
  for (std::uint32_t i = 0; i < memory.size(); ++i) {
    if (!memory[i].queued) continue;
    const std::size_t size = std::min(frame.bytes.size(), memory[i].bytes.size());
    std::copy_n(frame.bytes.begin(), size, memory[i].bytes.begin());
    memory[i].queued = false;
    buffer.index = i;
    buffer.bytesused = static_cast<std::uint32_t>(size);
    buffer.flags = frame.flags;
    const double stamp_s = now_s - frame.older_s;
    buffer.timestamp.tv_sec = static_cast<time_t>(std::floor(stamp_s));
    buffer.timestamp.tv_usec = static_cast<suseconds_t>(1e6 * (stamp_s - std::floor(stamp_s)));
    ready.push_back(buffer);
    return;
  }
}

FakeMachine::FakeMachine() {
  fs::create_directories(folder_.path() + "/sys/class");
  fs::create_directories(folder_.path() + "/dev");
}

FakeMachine::~FakeMachine() {
  Devices().clear();
}

std::string FakeMachine::Path(int number) const {
  return folder_.path() + "/dev/video" + std::to_string(number);
}

FakeDevice& FakeMachine::Plug(int number, const std::string& port, const std::string& serial) {
  const std::string usb = folder_.path() + "/sys/devices/usb1/" + port;
  const std::string interface = usb + "/" + port + ":1.0";
  const std::string node = folder_.path() + "/sys/class/video" + std::to_string(number);
  fs::create_directories(interface);
  fs::create_directories(node);
  fs::remove(node + "/device");
  fs::create_directory_symlink(interface, node + "/device");
  std::ofstream(node + "/name") << "Fake camera: its name\n";
  std::ofstream(usb + "/idVendor") << "046d\n";
  std::ofstream(usb + "/idProduct") << "0825\n";
  fs::remove(usb + "/serial");
  if (!serial.empty()) std::ofstream(usb + "/serial") << serial << '\n';
  std::ofstream(Path(number)) << "";
  auto& device = Devices()[fs::canonical(Path(number))];
  device = std::make_unique<FakeDevice>();
  return *device;
}

void FakeMachine::Unplug(int number) {
  Devices().at(fs::canonical(Path(number)))->gone = true;
  fs::remove_all(folder_.path() + "/sys/class/video" + std::to_string(number));
  fs::remove(Path(number));
}

}  // namespace plumbline::test

extern "C" {
// NOLINTBEGIN(bugprone-reserved-identifier)
void* __real_mmap(void*, std::size_t, int, int, int, off_t);
int __real_munmap(void*, std::size_t);
int __real_poll(pollfd*, nfds_t, int);

int __wrap_ioctl(int fd, unsigned long request, ...) {
  va_list arguments;
  va_start(arguments, request);
  void* argument = va_arg(arguments, void*);
  va_end(arguments);
  auto* device = plumbline::test::DeviceOf(fd);
  return device != nullptr ? plumbline::test::Answer(*device, request, argument)
                           : plumbline::test::Refuse(ENOTTY);
}
int __wrap_poll(pollfd* fds, nfds_t count, int timeout_ms) {
  struct stat about {};
  if (fstat(fds->fd, &about) == 0 && S_ISSOCK(about.st_mode))  // to plumbline-dv
    return __real_poll(fds, count, timeout_ms);
  auto* device = plumbline::test::DeviceOf(fds->fd);
  if (device == nullptr || device->gone) {
    fds->revents = POLLERR | POLLHUP;
    return 1;
  }
  if (device->ready.empty() && !device->coming.empty() && timeout_ms >= 30) {
    plumbline::test::now_s += 0.03;
    device->Arrive(device->coming.front());
    device->coming.pop_front();
  }
  fds->revents = device->ready.empty() ? short{0} : short{POLLIN};
  if (device->ready.empty()) plumbline::test::now_s += 1e-3 * timeout_ms;
  return device->ready.empty() ? 0 : 1;
}
void* __wrap_mmap(void* hint, std::size_t size, int protection, int flags, int fd, off_t offset) {
  auto* device = fd >= 0 ? plumbline::test::DeviceOf(fd) : nullptr;
  if (device == nullptr) return __real_mmap(hint, size, protection, flags, fd, offset);
  void* memory = device->memory.at(static_cast<std::size_t>(offset) / 4096).bytes.data();
  plumbline::test::Shared().insert(memory);
  return memory;
}
int __wrap_munmap(void* memory, std::size_t size) {
  return plumbline::test::Shared().erase(memory) > 0 ? 0 : __real_munmap(memory, size);
}
// NOLINTEND(bugprone-reserved-identifier)
}
