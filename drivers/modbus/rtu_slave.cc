#include "drivers/modbus/rtu_slave.h"

#include <fcntl.h>
#include <poll.h>
#include <pthread.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <ctime>
#include <system_error>

#include "drivers/files/open_failure.h"
#include "drivers/modbus/errno_text.h"
#include "drivers/os/serial_line.h"

namespace plumbline::modbus {
namespace {

constexpr double kFirstBackOff_s = 0.1, kLastBackOff_s = 1;
constexpr int kWriteTimeout_ms = 500;

os::SerialSettings LineOf(const RtuSlaveOptions& options) {
  return {.baud = options.baud, .parity = options.parity, .stop_bits = options.stop_bits};
}

/// poll() with a timeout in seconds; negative: none. @return true if any descriptor is ready
bool Poll(pollfd* fds, nfds_t count, double time_s) {
  const double whole_s = std::floor(time_s);
  const timespec limit{.tv_sec = static_cast<time_t>(whole_s),
                       .tv_nsec = static_cast<long>((time_s - whole_s) * 1e9)};
  return ::ppoll(fds, count, time_s < 0 ? nullptr : &limit, nullptr) > 0;
}

}  // namespace

Result<std::unique_ptr<RtuSlave>> RtuSlave::Start(const RtuSlaveOptions& options,
                                                  RequestHandler& handler) {
  if (const std::string fault = os::FaultOf(LineOf(options)); !fault.empty()) return Error{fault};
  if (options.unit_id < 1 || options.unit_id > 247) {
    return Error{"unit id " + std::to_string(options.unit_id) + " is outside 1..247"};
  }
  std::unique_ptr<RtuSlave> slave(new RtuSlave(options, handler));
  if (!slave->stop_) return Error{"cannot start the RTU slave: " + ErrnoText()};
  slave->thread_ = std::thread([raw = slave.get()] { raw->Run(); });
  ::pthread_setname_np(slave->thread_.native_handle(), "modbus line");
  return slave;
}

RtuSlave::RtuSlave(const RtuSlaveOptions& options, RequestHandler& handler)
    : options_(options),
      silence_s_(RtuSilence_s(options.baud)),
      handler_(handler),
      receiver_(options.unit_id),
      stop_(::eventfd(0, EFD_CLOEXEC)) {}

RtuSlave::~RtuSlave() {
  if (!thread_.joinable()) return;
  ::eventfd_write(stop_.get(), 1);
  thread_.join();
}

RtuSlaveCounters RtuSlave::counters() const {
  return {.requests = counters_.requests,
          .broadcasts = counters_.broadcasts,
          .discarded = counters_.discarded,
          .openings = counters_.openings};
}

void RtuSlave::Run() {
  sigset_t all;
  sigfillset(&all);
  ::pthread_sigmask(SIG_SETMASK, &all, nullptr);  // signals belong to the main thread
  double back_off_s = kFirstBackOff_s;
  for (;;) {
    heartbeat_.Beat();
    if (OpenDevice()) {
      const std::uint64_t before = counters_.requests;
      ServeUntilLost();
      if (counters_.requests != before) back_off_s = kFirstBackOff_s;
    }
    if (!SleepUnlessStopped(back_off_s)) return;
    back_off_s = std::min(2 * back_off_s, kLastBackOff_s);
  }
}

bool RtuSlave::OpenDevice() {
  line_.Reset(::open(options_.device.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (!line_ || !os::ConfigureSerialLine(line_.get(), LineOf(options_))) {
    Disconnect(files::OpenErrorText(errno, files::kSerialLine));
    return false;
  }
  receiver_.Clear();
  ++counters_.openings;
  if (loss_reported_ && options_.on_change) options_.on_change("");
  loss_reported_ = false;
  return true;
}

/// @return false if the slave must stop
bool RtuSlave::SleepUnlessStopped(double time_s) {
  while (time_s > 0) {
    heartbeat_.Beat();
    pollfd stop{.fd = stop_.get(), .events = POLLIN, .revents = 0};
    if (Poll(&stop, 1, std::min(time_s, ThreadHeartbeat::kMaxBeatInterval_s))) return false;
    time_s -= ThreadHeartbeat::kMaxBeatInterval_s;
  }
  return true;
}

void RtuSlave::ServeUntilLost() {
  double wait_s = -1;
  for (;;) {
    heartbeat_.Beat();
    std::array<pollfd, 2> fds{pollfd{.fd = line_.get(), .events = POLLIN, .revents = 0},
                              pollfd{.fd = stop_.get(), .events = POLLIN, .revents = 0}};
    const bool any =
        Poll(fds.data(), fds.size(), wait_s < 0 ? ThreadHeartbeat::kMaxBeatInterval_s : wait_s);
    if (fds[1].revents != 0) return;
    if (any && fds[0].revents != 0) {
      if (!ReadBytes()) return;
      wait_s = silence_s_;
    } else if (wait_s == silence_s_) {
      HandleFrames();
      wait_s = receiver_.pending() ? std::max(options_.frame_timeout_s, silence_s_ * 1.01) : -1;
    } else if (receiver_.pending()) {
      ++counters_.discarded;
      receiver_.Clear();
      wait_s = -1;
    }
  }
}

/// @return false if the line was lost
bool RtuSlave::ReadBytes() {
  std::array<std::uint8_t, kMaxRtuFrameBytes> bytes;
  const ssize_t size = ::read(line_.get(), bytes.data(), bytes.size());
  if (size > 0) {
    receiver_.Push({bytes.data(), static_cast<std::size_t>(size)});
    return true;
  }
  if (size < 0 && (errno == EAGAIN || errno == EINTR)) return true;
  Disconnect("lost: " + (size == 0 ? "hung up" : ErrnoText()));
  return false;
}

void RtuSlave::HandleFrames() {
  std::array<std::uint8_t, kMaxPduBytes> response;
  while (const auto frame = receiver_.Next()) {
    ++counters_.requests;
    const std::size_t size = handler_.Handle(Client(), frame->pdu, response);
    if (frame->address == kBroadcastAddress) {
      ++counters_.broadcasts;
    } else if (frame->newest && size > 0) {
      std::array<std::uint8_t, kMaxRtuFrameBytes> reply;
      WriteReply({reply.data(), WriteRtuFrame(frame->address, {response.data(), size}, reply)});
    }
  }
}

/// Drops the response if the line accepts no bytes for half a second; if the line is gone the next
/// read reports it.
void RtuSlave::WriteReply(std::span<const std::uint8_t> reply) const {
  while (!reply.empty()) {
    const ssize_t written = ::write(line_.get(), reply.data(), reply.size());
    if (written > 0) {
      reply = reply.subspan(static_cast<std::size_t>(written));
      continue;
    }
    pollfd line{.fd = line_.get(), .events = POLLOUT, .revents = 0};
    if (written < 0 && errno != EAGAIN && errno != EINTR) return;
    if (::poll(&line, 1, kWriteTimeout_ms) <= 0) return;
  }
}

void RtuSlave::Disconnect(const std::string& reason) {
  line_.Reset();
  if (!loss_reported_ && options_.on_change) options_.on_change(reason);
  loss_reported_ = true;
}

}  // namespace plumbline::modbus
