#include "drivers/zoom/visca_zoom.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <utility>

#include "drivers/files/open_failure.h"
#include "drivers/os/serial_line.h"
#include "drivers/zoom/registry.h"

namespace plumbline::zoom {
namespace {

using visca::Reply;

std::string_view BaudFault(ZoomConnection& to) {
  return to.visca.baud == 9600 || to.visca.baud == 38400 ? "" : "is not 9600 or 38400";
}

constexpr ZoomOption kViscaOptions[] = {
    {.key = "device",
     .value = [](ZoomConnection& to) -> std::string& { return to.visca.device; },
     .description = "for \"visca\", like the next four, and \"v4l2\": device",
     .example = "\"/dev/serial/by-id/...\"",
     .default_text = "for \"v4l2\": the camera's",
     .required = true},
    {.key = "baud",
     .value = [](ZoomConnection& to) -> int& { return to.visca.baud; },
     .min = 9600,
     .max = 38400,
     .description = "9600 or 38400 bit/s",
     .fault = BaudFault},
    {.key = "address",
     .value = [](ZoomConnection& to) -> int& { return to.visca.address; },
     .min = 1,
     .max = visca::kMaxCameras,
     .description = "VISCA address of the camera"},
    {.key = "timeout_ms",
     .value = [](ZoomConnection& to) -> double& { return to.visca.timeout_s; },
     .min = 10,
     .max = 10000,
     .to_si = kSecondPerMs,
     .description = "timeout of one request, also for \"hid\""},
    {.key = "optical_max_counts",
     .value = [](ZoomConnection& to) -> int& { return to.visca.optical_max_counts; },
     .min = 1,
     .max = 1 << 24,
     .description = "end of the optical range; the digital zoom beyond it is never calibrated"},
};

/// Waits for at most `left_s` until the descriptor is ready. @return the result of poll()
int WaitFor(int fd, short events, double left_s) {
  pollfd wait{.fd = fd, .events = events, .revents = 0};
  const int ready = poll(&wait, 1, std::max(0, static_cast<int>(std::ceil(1e3 * left_s))));
  if (ready <= 0 || (wait.revents & events) != 0) return ready;
  errno = EIO;  // hung up with nothing to read
  return -1;
}

}  // namespace

Result<std::unique_ptr<ZoomSensor>> ViscaZoom::Create(const ViscaOptions& options, Clock clock) {
  if (const std::string fault = os::FaultOf({.baud = options.baud}); !fault.empty()) {
    return Error{"visca: " + fault};
  }
  if (options.address < 1 || options.address > visca::kMaxCameras) {
    return Error{fmt::format("visca: address {} is outside 1..7", options.address)};
  }
  if (!(options.timeout_s >= 0.01 && options.timeout_s <= 10)) {
    return Error{fmt::format("visca: timeout {} s is outside 0.01..10", options.timeout_s)};
  }
  return std::unique_ptr<ZoomSensor>(new ViscaZoom(options, clock));
}

ViscaZoom::ViscaZoom(ViscaOptions options, Clock clock)
    : options_(std::move(options)), clock_(clock) {}

ZoomResult ViscaZoom::Fail(ZoomResult result, const std::string& why) {
  problem_ = fmt::format("{}: camera {}: {}", options_.device, options_.address, why);
  return result;
}

ZoomResult ViscaZoom::Disconnect(const std::string& why) {
  fd_.Reset();
  back_off_.Failed(clock_());
  return Fail(ZoomResult::kLost, why);
}

bool ViscaZoom::Open() {
  fd_.Reset(open(options_.device.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (!fd_ || !os::ConfigureSerialLine(fd_.get(), {.baud = options_.baud})) {
    Disconnect(files::OpenErrorText(errno, files::kSerialLine));
    return false;
  }
  receiver_.Clear();
  addressed_ = false;
  return true;
}

ZoomResult ViscaZoom::Read(lens::ZoomReading& reading) {
  const double deadline_s = clock_() + options_.timeout_s;
  if (!fd_) {
    if (!back_off_.Due(clock_())) return ZoomResult::kWaiting;
    if (!Open()) return ZoomResult::kLost;
  }
  ZoomResult result = Drain();
  if (result == ZoomResult::kOk && !addressed_) result = AssignAddresses(deadline_s);
  lens::ZoomReading found;
  if (result == ZoomResult::kOk) result = ReadLens(found, deadline_s);
  if (result != ZoomResult::kOk) {
    if (result != ZoomResult::kRefused) addressed_ = false;
    return result;
  }
  back_off_.Well();
  if (*found.zoom_counts > options_.optical_max_counts) found.digital_zoom = true;
  found.time_s = clock_();
  reading = found;
  return ZoomResult::kOk;
}

/// Discards pending input; only a network change is evaluated.
ZoomResult ViscaZoom::Drain() {
  std::array<std::uint8_t, 256> bytes;
  for (;;) {
    const ssize_t size = read(fd_.get(), bytes.data(), bytes.size());
    if (size < 0 && errno == EINTR) continue;
    if (size < 0 && errno == EAGAIN) break;
    if (size <= 0) return Disconnect(size == 0 ? "hung up" : std::strerror(errno));
    for (ssize_t i = 0; i < size; ++i) {
      const auto reply = receiver_.Push(bytes[static_cast<std::size_t>(i)]);
      if (reply && reply->kind == Reply::Kind::kNetworkChange) addressed_ = false;
    }
    if (size < static_cast<ssize_t>(bytes.size())) break;
  }
  receiver_.Clear();
  return ZoomResult::kOk;
}

ZoomResult ViscaZoom::AssignAddresses(double deadline_s) {
  Reply answer;
  const ZoomResult result = Query(visca::AddressSet(), 0, deadline_s, answer);
  if (result != ZoomResult::kOk) return result;
  if (answer.address < options_.address) {
    return Fail(ZoomResult::kRefused,
                fmt::format("only {} cameras answer on the line. Check camera.zoom.address and the "
                            "cable to the camera.",
                            answer.address));
  }
  addressed_ = has_block_ = has_focus_ = true;
  return ZoomResult::kOk;
}

ZoomResult ViscaZoom::ReadLens(lens::ZoomReading& reading, double deadline_s) {
  if (has_block_) {
    Reply answer;
    const ZoomResult result =
        Query(visca::LensBlock(options_.address), visca::kLensBlockBytes, deadline_s, answer);
    if (result == ZoomResult::kOk) {
      return visca::LensBlockFrom(answer, reading)
                 ? ZoomResult::kOk
                 : Fail(ZoomResult::kProtocol, "invalid lens block");
    }
    if (result != ZoomResult::kRefused || answer.error != 0x02) return result;
    has_block_ = false;
  }
  ZoomResult result =
      QueryPosition(visca::ZoomPosition(options_.address), deadline_s, reading.zoom_counts);
  if (result != ZoomResult::kOk) return result;
  reading.digital_zoom = *reading.zoom_counts > options_.optical_max_counts;
  if (!has_focus_) return ZoomResult::kOk;
  result = QueryPosition(visca::FocusPosition(options_.address), deadline_s, reading.focus_counts);
  if (result != ZoomResult::kRefused) return result;
  has_focus_ = false;
  return ZoomResult::kOk;
}

ZoomResult ViscaZoom::QueryPosition(const visca::Request& request, double deadline_s,
                                    std::optional<std::int32_t>& counts) {
  Reply answer;
  const ZoomResult result = Query(request, visca::kPositionBytes, deadline_s, answer);
  if (result != ZoomResult::kOk) return result;
  counts = visca::PositionFrom(answer);
  return counts ? ZoomResult::kOk : Fail(ZoomResult::kProtocol, "invalid position");
}

bool ViscaZoom::Send(const visca::Request& request, double deadline_s) {
  std::span<const std::uint8_t> rest = request.span();
  while (!rest.empty()) {
    const ssize_t written = write(fd_.get(), rest.data(), rest.size());
    if (written > 0) {
      rest = rest.subspan(static_cast<std::size_t>(written));
      continue;
    }
    if (written < 0 && errno != EAGAIN && errno != EINTR) return false;
    if (WaitFor(fd_.get(), POLLOUT, deadline_s - clock_()) <= 0) return false;
  }
  return true;
}

ZoomResult ViscaZoom::Query(const visca::Request& request, std::size_t length, double deadline_s,
                            Reply& answer) {
  if (!Send(request, deadline_s)) return Disconnect("cannot write to the line");
  return Wait(length, deadline_s, answer);
}

ZoomResult ViscaZoom::Wait(std::size_t length, double deadline_s, Reply& answer) {
  int malformed = 0, other = 0;  // other: address of another camera that answered
  for (;;) {
    const double left_s = deadline_s - clock_();
    const int ready = left_s > 0 ? WaitFor(fd_.get(), POLLIN, left_s) : 0;
    if (ready < 0 && errno == EINTR) continue;
    if (ready < 0) return Disconnect("hung up");
    if (ready == 0) break;
    // One byte at a time: anything after the answer is left for the next Drain().
    std::uint8_t byte = 0;
    const ssize_t size = read(fd_.get(), &byte, 1);
    if (size < 0 && (errno == EAGAIN || errno == EINTR)) continue;
    if (size <= 0) return Disconnect(size == 0 ? "hung up" : std::strerror(errno));
    const std::optional<Reply> reply = receiver_.Push(byte);
    if (!reply) continue;
    const bool mine = reply->address == options_.address;
    if (reply->kind == Reply::Kind::kMalformed) ++malformed;
    if (reply->kind == Reply::Kind::kNetworkChange) addressed_ = false;
    if (length == 0 && reply->kind == Reply::Kind::kAddressed) {
      answer = *reply;
      return ZoomResult::kOk;
    }
    if (!mine && reply->kind == Reply::Kind::kAnswer) other = reply->address;
    if (length == 0 || !mine) continue;
    if (reply->kind == Reply::Kind::kAnswer && reply->size == length) {
      answer = *reply;
      return ZoomResult::kOk;
    }
    if (reply->kind == Reply::Kind::kError) {
      answer = *reply;
      return Fail(ZoomResult::kRefused, fmt::format("reports an error: {} ({:02X})",
                                                    visca::ErrorText(reply->error), reply->error));
    }
  }
  if (malformed > 0) {
    return Fail(ZoomResult::kProtocol,
                fmt::format("{} invalid packets. Check that the camera is set to {} baud.",
                            malformed, options_.baud));
  }
  if (other > 0) {
    problem_ =
        fmt::format("{}: camera {} does not answer, but camera {} does. Check camera.zoom.address.",
                    options_.device, options_.address, other);
    return ZoomResult::kTimeout;
  }
  return Fail(ZoomResult::kTimeout,
              fmt::format("no answer within {:.0f} ms. Check that it is on and set to {} baud.",
                          1e3 * options_.timeout_s, options_.baud));
}

const ZoomKind kViscaKind{
    .name = "visca",
    .make = [](const ZoomConnection& to) { return ViscaZoom::Create(to.visca, to.clock); },
    .identity = [](const ZoomConnection& to) { return to.visca.device; },
    .device = [](const ZoomConnection& to) { return Result<std::string>(to.visca.device); },
    .remedy = "plug in the adapter; add the user to the group dialout",
    .options = kViscaOptions};

}  // namespace plumbline::zoom
