#include "drivers/camera/v4l2_camera.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/videodev2.h>
#include <poll.h>
#include <sys/mman.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <utility>

#include "drivers/files/open_failure.h"
#include "drivers/ioctl.h"
#include "firmware-like/image/image_size.h"

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

namespace {

constexpr double kSilenceTimeout_s = 5;   // a streaming camera sends something within this time
constexpr double kMaxTimestampAge_s = 1;  // an older time stamp is from another clock
constexpr double kMaxWait_s = 10;         // upper limit of the timeout

Result<void> CheckOptions(const V4l2CameraOptions& o) {
  if (o.device.empty())
    return Error{"v4l2 camera: no device configured. List the cameras with plumbline cameras."};
  const auto [width, height] = o.mode.size;
  const auto is_side = [](int side) { return side >= 1 && side <= kMaxImageSide_px; };
  if (o.mode.size != image::ImageSize{} && !(is_side(width) && is_side(height))) {
    return Error{fmt::format("v4l2 camera: {} x {} px is not a valid size", width, height)};
  }
  if (!(o.mode.rate_hz >= 0.01 && o.mode.rate_hz <= 1000)) {
    return Error{fmt::format("v4l2 camera: {} Hz is outside 0.01..1000", o.mode.rate_hz)};
  }
  const CameraSettings& s = o.settings;
  if (s.exposure_s && !(*s.exposure_s >= 1e-6 && *s.exposure_s <= 60)) {
    return Error{fmt::format("v4l2 camera: exposure {} s is outside 1e-6..60", *s.exposure_s)};
  }
  if (s.white_balance_K && !(*s.white_balance_K >= 1000 && *s.white_balance_K <= 40000)) {
    return Error{
        fmt::format("v4l2 camera: white balance {} K is outside 1000..40000", *s.white_balance_K)};
  }
  return {};
}

}  // namespace

std::uint64_t NextSequence(std::uint64_t last, std::optional<std::uint32_t> driver_last,
                           std::uint32_t driver_now) {
  const std::uint32_t passed = driver_last ? driver_now - *driver_last : 1;
  return last + (passed > 0 && passed < 1U << 31 ? passed : 1);
}

Result<std::unique_ptr<Camera>> V4l2Camera::Create(const V4l2CameraOptions& options, Clock clock) {
  if (const Result<void> valid = CheckOptions(options); !valid) return valid.failure();
  return std::unique_ptr<Camera>(new V4l2Camera(options, clock));
}

V4l2Camera::V4l2Camera(V4l2CameraOptions options, Clock clock)
    : options_(std::move(options)), clock_(clock), path_(options_.device) {}

void V4l2Camera::Close() {
  raw_.bytes = {};
  stream_.reset();
  fd_.Reset();
}

CameraResult V4l2Camera::Disconnect(const std::string& why) {
  Close();
  back_off_.Failed(clock_());
  problem_ = fmt::format("{}: {}", path_, why);
  return CameraResult::kLost;
}

std::vector<std::string> V4l2Camera::TakeRemarks() {
  if (dv_) {
    for (const std::string& remark : dv_->TakeRemarks()) {
      remarks_.push_back(fmt::format("{}: {}", path_, remark));
    }
  }
  return std::exchange(remarks_, {});
}

Result<image::LumaView> V4l2Camera::Luma() {
  if (raw_.format != PixelFormat::kDv) return LumaOf(raw_, luma_);
  const auto field = dv_->Decode(raw_.bytes);
  if (!field) return field.failure();
  dv_field_ = *field;
  raw_.size = SquareSize(field->format);
  identity_.mode = DvDecoder::ModeTextOf(field->format);
  return SquareLuma(dv_field_, field_luma_, luma_);
}

const std::vector<std::uint8_t>* V4l2Camera::Bgr() {
  if (!raw_.bytes.empty() && raw_.format == PixelFormat::kDv) {
    SquareBgr(dv_field_, bgr_);
    return &bgr_;
  }
  return raw_.bytes.empty() || !BgrOf(raw_, bgr_) ? nullptr : &bgr_;
}

Result<void> V4l2Camera::Open() {
  path_ = options_.device;
  remarks_.clear();  // discard those of a failed attempt
  const std::vector<V4l2Device> all = ListV4l2Devices(options_.tree);
  const auto device = SelectV4l2Device(options_.device, all);
  if (!device) return device.failure();
  path_ = device->path;
  fd_.Reset(open(path_.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC));
  if (!fd_) {
    return Error{files::OpenErrorText(errno, files::kCameraDevice)};
  }
  if (auto set = SetMode(*device); !set) return set;
  for (std::string& remark : ApplySettings(fd_.get(), options_.settings)) {
    remarks_.push_back(fmt::format("{}: {}", path_, remark));
  }
  auto stream = V4l2Stream::Start(fd_.get());
  if (!stream) return stream.failure();
  stream_ = std::move(stream).value();
  // A name that once needed its port keeps it, even while the other camera is disconnected.
  const std::string name = StableName(*device, all), with_port = NameWithPort(*device);
  named_with_port_ = named_with_port_ || name == with_port || options_.device == with_port;
  identity_.serial = named_with_port_ ? with_port : name;
  identity_.mode = ModeText(raw_.format, raw_.size, rate_hz_);
  last_activity_s_ = clock_();
  last_sequence_.reset();
  return {};
}

Result<void> V4l2Camera::SetMode(const V4l2Device& device) {
  v4l2_capability capability{};
  if (IoctlAgain(fd_.get(), VIDIOC_QUERYCAP, &capability) != 0)
    return Error{"is not a V4L2 device"};
  const std::uint32_t caps = (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0
                                 ? capability.device_caps
                                 : capability.capabilities;
  constexpr std::uint32_t kNeeded = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
  if ((caps & (V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_VIDEO_CAPTURE_MPLANE)) ==
      V4L2_CAP_VIDEO_CAPTURE_MPLANE) {
    return Error{kMultiPlanar};
  }
  if ((caps & kNeeded) != kNeeded) {
    return Error{
        "does not support streaming capture. Choose another device with plumbline cameras."};
  }
  const auto choice = ChooseMode(ModesOf(fd_.get()), options_.mode);
  if (!choice) return choice.failure();
  v4l2_format format{};
  format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  format.fmt.pix.width = static_cast<std::uint32_t>(choice->size.width);
  format.fmt.pix.height = static_cast<std::uint32_t>(choice->size.height);
  format.fmt.pix.pixelformat = FourccOf(choice->format);
  format.fmt.pix.field = V4L2_FIELD_NONE;
  if (IoctlAgain(fd_.get(), VIDIOC_S_FMT, &format) != 0) {
    return Error{
        fmt::format("the mode was rejected: {}{}", std::strerror(errno),
                    errno == EBUSY ? ". Check whether another program uses the camera." : "")};
  }
  const v4l2_pix_format& agreed = format.fmt.pix;
  if (choice->format == PixelFormat::kDv && agreed.pixelformat == FourccOf(choice->format)) {
    // Of one size and rate, and always interlaced.
    raw_ = {choice->format, {}, 0, {}};
    rate_hz_ = 0;
    if (!dv_) dv_.emplace(clock_, options_.dv_decoder);
    return {};
  }
  if (agreed.pixelformat != FourccOf(choice->format) ||
      agreed.width != static_cast<std::uint32_t>(choice->size.width) ||
      agreed.height != static_cast<std::uint32_t>(choice->size.height)) {
    return Error{fmt::format("the camera offers {} but set {} {}x{}",
                             ModeText(choice->format, choice->size, 0),
                             FourccText(agreed.pixelformat), agreed.width, agreed.height)};
  }
  if (agreed.field != V4L2_FIELD_NONE && agreed.field != V4L2_FIELD_ANY) {
    return Error{
        "sends interlaced images, which cannot be measured. Set the camera to progressive."};
  }
  raw_ = {choice->format, choice->size, static_cast<std::ptrdiff_t>(agreed.bytesperline), {}};
  v4l2_streamparm rate{};
  rate.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  rate_hz_ = 0;
  if (choice->rate_hz > 0) {
    rate.parm.capture.timeperframe.numerator = 1000;
    rate.parm.capture.timeperframe.denominator =
        static_cast<std::uint32_t>(std::lround(1000 * choice->rate_hz));
    if (IoctlAgain(fd_.get(), VIDIOC_S_PARM, &rate) == 0 &&
        rate.parm.capture.timeperframe.numerator > 0) {
      rate_hz_ = static_cast<double>(rate.parm.capture.timeperframe.denominator) /
                 rate.parm.capture.timeperframe.numerator;
    }
  }
  if (rate_hz_ > 0 && rate_hz_ < 0.98 * options_.mode.rate_hz) {
    remarks_.push_back(fmt::format(
        "{}: {} runs at {:.4g} frames per second instead of the requested {:g}", device.path,
        ModeText(raw_.format, raw_.size, 0), rate_hz_, options_.mode.rate_hz));
  }
  return {};
}

bool V4l2Camera::WaitForFrame(double deadline_s) const {
  const double left_s = std::clamp(deadline_s - clock_(), 0.0, kMaxWait_s);
  pollfd wait{.fd = fd_.get(), .events = POLLIN, .revents = 0};
  // An error of poll() itself, such as EINTR, says nothing about the device.
  if (poll(&wait, 1, static_cast<int>(std::ceil(1e3 * left_s))) <= 0) return true;
  return (wait.revents & (POLLERR | POLLHUP | POLLNVAL)) == 0;
}

void V4l2Camera::FillFrame(const V4l2Frame& taken, const image::LumaView& luma,
                           CameraFrame& frame) {
  const double now_s = clock_();
  double time_s = taken.time_s.value_or(now_s);
  if (!(time_s <= now_s && time_s >= now_s - kMaxTimestampAge_s)) time_s = now_s;
  if (!(time_s > last_time_s_)) time_s = now_s;
  last_time_s_ = time_s;
  sequence_ = NextSequence(sequence_, last_sequence_, taken.sequence);
  last_sequence_ = taken.sequence;
  frame = {luma, time_s, sequence_};
}

CameraResult V4l2Camera::Read(double timeout_s, CameraFrame& frame) {
  if (!fd_) {
    if (!back_off_.Due(clock_())) return CameraResult::kWaiting;
    if (const auto opened = Open(); !opened) return Disconnect(opened.error());
  }
  raw_.bytes = {};
  problem_.clear();
  const double deadline_s = clock_() + std::clamp(timeout_s, 0.0, kMaxWait_s);
  for (;;) {
    const bool alive = WaitForFrame(deadline_s);
    V4l2Frame taken;
    const V4l2StreamResult answer = stream_->TakeNewest(taken);
    if (answer == V4l2StreamResult::kGone) {
      return Disconnect(
          fmt::format("lost: {}. Check that it is plugged in.", std::strerror(errno)));
    }
    if (!alive && answer == V4l2StreamResult::kNotReady)
      return Disconnect("lost. Check that it is plugged in.");
    if (answer != V4l2StreamResult::kNotReady) last_activity_s_ = clock_();
    if (answer == V4l2StreamResult::kDamaged) {
      problem_ =
          fmt::format("{}: damaged frames. Check the cable and the load of its USB bus.", path_);
    }
    if (answer == V4l2StreamResult::kFrame) {
      raw_.bytes = taken.bytes;
      const auto luma = Luma();
      if (luma) {
        back_off_.Well();
        problem_.clear();
        FillFrame(taken, *luma, frame);
        return CameraResult::kFrame;
      }
      raw_.bytes = {};
      problem_ = fmt::format("{}: {}", path_, luma.error());
    }
    if (clock_() - last_activity_s_ > kSilenceTimeout_s) {
      return Disconnect(fmt::format("no data for {:g} s; reopening", kSilenceTimeout_s));
    }
    if (clock_() >= deadline_s) break;
  }
  if (!problem_.empty()) return CameraResult::kUnusable;
  problem_ = fmt::format("{}: no frame within {:g} s", path_, timeout_s);
  return CameraResult::kNoFrame;
}

}  // namespace plumbline::camera
