#include "drivers/camera/dv_decoder.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <utility>

#include "drivers/camera/v4l2_modes.h"
#include "drivers/files/package_paths.h"

namespace plumbline::camera {
namespace {

constexpr double kAnswerTimeout_s = 0.5;  // a frame takes about 2 ms
constexpr double kStartTimeout_s = 3;     // loading libavcodec takes 24 ms
constexpr double kEndTimeout_s = 0.1;
constexpr std::uint64_t kProven = 25;  // frames after which the process is restarted at once
constexpr int kDecoderNice = 5;        // that of the threads of the images

/// Waits until the socket is ready. @return false at `until_s`
bool AwaitSocket(int fd, short events, double until_s) {
  for (;;) {
    const double left_s = until_s - MonotonicSeconds();
    if (left_s <= 0) return false;
    pollfd wait{.fd = fd, .events = events, .revents = 0};
    const int ready = poll(&wait, 1, static_cast<int>(std::ceil(1e3 * left_s)));
    if (ready > 0) return true;
    if (ready < 0 && errno != EINTR) return false;
  }
}

bool CouldNotStart(const os::ExitStatus& end) {
  const int code = end.exit_code.value_or(0);
  return code == kDvNoLibrary || code == kDvNoSandbox || code == os::ExitStatus::kNotRun;
}

std::string WhyDecoderEnded(const os::ExitStatus& end, const std::string& program) {
  if (end.exit_code == kDvNoLibrary) {
    return "plumbline-dv found no libavcodec: `sudo apt install libavcodec59` installs it";
  }
  if (end.exit_code == kDvNoSandbox) {
    return "plumbline-dv could not restrict its rights and decodes nothing; use a kernel with "
           "seccomp";
  }
  if (end.exit_code == os::ExitStatus::kNotRun) {
    return fmt::format("{} cannot be started; {}", program, files::kRestoreProgram);
  }
  if (end.exit_code) return fmt::format("plumbline-dv ended with code {}", *end.exit_code);
  return fmt::format("plumbline-dv was ended ({})", strsignal(end.signal));
}

}  // namespace

std::string DvProgram() {
  return files::SiblingProgram("plumbline-dv");
}

std::string DvDecoder::ModeTextOf(const DifFormat& format) {
  return ModeText(PixelFormat::kDv, SquareSize(format), FrameRate(format));
}

DvDecoder::DvDecoder(Clock clock, std::string program)
    : clock_(clock), program_(std::move(program)) {}

std::vector<std::string> DvDecoder::TakeRemarks() {
  return std::exchange(remarks_, {});
}

Result<void> DvDecoder::Start() {
  std::array<int, 2> ends{};
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) {
    return Error{fmt::format("cannot create a socket to plumbline-dv: {}", std::strerror(errno))};
  }
  socket_.Reset(ends[0]);
  const os::Descriptor theirs(ends[1]);
  auto child = os::ChildProcess::Start(
      {.arguments = {program_, "decode"},
       .descriptors = {{STDIN_FILENO, theirs.get()}, {STDOUT_FILENO, theirs.get()}},
       .nice = kDecoderNice});
  if (!child) return Error{fmt::format("cannot start plumbline-dv: {}", child.error())};
  child_ = std::move(child).value();
  decoded_ = 0;
  return {};
}

bool DvDecoder::Send(std::span<const std::uint8_t> bytes, double until_s) {
  while (!bytes.empty()) {
    const ssize_t sent =
        send(socket_.get(), bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
    if (sent > 0) {
      bytes = bytes.subspan(static_cast<std::size_t>(sent));
    } else if (sent == 0 || (errno != EAGAIN && errno != EINTR) ||
               !AwaitSocket(socket_.get(), POLLOUT, until_s)) {
      return false;
    }
  }
  return true;
}

bool DvDecoder::Receive(std::span<std::uint8_t> bytes, double until_s) {
  while (!bytes.empty()) {
    const ssize_t got = recv(socket_.get(), bytes.data(), bytes.size(), MSG_DONTWAIT);
    if (got > 0) {
      bytes = bytes.subspan(static_cast<std::size_t>(got));
    } else if (got == 0 || (errno != EAGAIN && errno != EINTR) ||
               !AwaitSocket(socket_.get(), POLLIN, until_s)) {
      return false;
    }
  }
  return true;
}

bool DvDecoder::Exchange(std::span<const std::uint8_t> frame, const DifFormat& format) {
  const double until_s = MonotonicSeconds() + (decoded_ > 0 ? kAnswerTimeout_s : kStartTimeout_s);
  std::array<std::uint8_t, sizeof(DvAnswerHeader)> header{};
  if (!Send(frame, until_s) || !Receive(header, until_s)) return false;
  const auto bytes = DvAnswerBytes(header, format);
  if (!bytes) return false;
  picture_.resize(*bytes);
  return Receive(picture_, until_s);
}

/// The process is killed if it still runs: it hangs, or has not answered as agreed. One that could
/// not start working has lost no picture to a frame.
Error DvDecoder::OnProcessLost() {
  const os::ExitStatus end = child_.End(kEndTimeout_s);
  socket_.Reset();
  why_ended_ = WhyDecoderEnded(end, program_);
  if (decoded_ < kProven) back_off_.Failed(clock_());
  if (!CouldNotStart(end) && std::has_single_bit(++lost_)) {
    remarks_.push_back(
        fmt::format("{} at a DV frame; the picture is lost and the process is started again. "
                    "Pictures lost in this way so far: {}",
                    why_ended_, lost_));
  }
  return Error{why_ended_};
}

Result<DvField> DvDecoder::Decode(std::span<const std::uint8_t> frame) {
  const Result<DifFormat> format = CheckDifFrame(frame);
  if (!format) return format.failure();
  if (!child_.started()) {
    if (!back_off_.Due(clock_())) return Error{why_ended_};
    if (auto started = Start(); !started) {
      why_ended_ = started.error();
      back_off_.Failed(clock_());
      return started.failure();
    }
  }
  if (!Exchange(frame, *format)) return OnProcessLost();
  if (++decoded_ == kProven) back_off_.Well();
  if (picture_.empty()) {
    return Error{"a damaged DV frame. Check the cable, and the tape if it plays one."};
  }
  return DvField{picture_, *format};
}

}  // namespace plumbline::camera
