#include "drivers/camera/dv_stream_camera.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <pthread.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <utility>

#include "drivers/files/open_failure.h"

namespace plumbline::camera {
namespace {

constexpr std::size_t kPiece = 1 << 16;  // what a FIFO holds
constexpr int kStopPoll_ms = 50;
constexpr double kFifoSilence_s = 5;
constexpr double kMaxFifoWait_s = 10;
constexpr std::uint64_t kUnreadableBytes = 288000;  // two frames of 625 lines

}  // namespace

Result<std::unique_ptr<Camera>> DvStreamCamera::Create(const DvStreamOptions& options,
                                                       Clock clock) {
  if (options.fifo.empty()) {
    return Error{"dv camera: no device configured. Name the FIFO that DV frames are written to."};
  }
  return std::unique_ptr<Camera>(new DvStreamCamera(options, clock));
}

DvStreamCamera::DvStreamCamera(DvStreamOptions options, Clock clock)
    : options_(std::move(options)), clock_(clock), decoder_(clock, options_.dv_decoder) {}

/// Opened for writing, too, so that the stream does not end when a writer ends: the next may
/// follow.
Result<void> DvStreamCamera::Open() {
  os::Descriptor opened(open(options_.fifo.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC | O_NOCTTY));
  if (!opened) return Error{files::ReadErrorText(options_.fifo, std::strerror(errno))};
  struct stat about {};
  if (fstat(opened.get(), &about) != 0 || !S_ISFIFO(about.st_mode)) {
    return Error{"is not a FIFO. Create one with mkfifo and have DV frames written to it."};
  }
  fifo_ = std::move(opened);
  arrived_ = {};
  arrived_.last_byte_s = clock_();
  reported_damaged_ = reported_skipped_ = 0;
  stop_ = false;
  thread_ = std::thread([this] { Drain(); });
  pthread_setname_np(thread_.native_handle(), "dv-stream");
  return {};
}

void DvStreamCamera::Close() {
  stop_ = true;
  if (thread_.joinable()) thread_.join();
  fifo_.Reset();
  has_picture_ = false;
}

void DvStreamCamera::Drain() {
  DifStream stream;
  std::vector<std::uint8_t> piece(kPiece);
  while (!stop_) {
    pollfd wait{.fd = fifo_.get(), .events = POLLIN, .revents = 0};
    poll(&wait, 1, kStopPoll_ms);
    while (!stop_ && DrainPiece(stream, piece)) {
    }
  }
}

bool DvStreamCamera::DrainPiece(DifStream& stream, std::vector<std::uint8_t>& piece) {
  const ssize_t got = read(fifo_.get(), piece.data(), piece.size());
  if (got <= 0) return false;
  const double now_s = clock_();
  const std::uint64_t damaged_before = stream.damaged();
  stream.Append(std::span(piece).first(static_cast<std::size_t>(got)));
  std::vector<std::uint8_t> frame;
  const int complete = stream.TakeNewest(frame);
  const std::lock_guard lock(mutex_);
  arrived_.last_byte_s = now_s;
  arrived_.damaged = stream.damaged();
  arrived_.skipped = stream.skipped();
  arrived_.why_damaged = stream.why_damaged();
  arrived_.sequence += static_cast<std::uint64_t>(complete) + stream.damaged() - damaged_before;
  if (complete == 0) return true;
  arrived_.frame = std::move(frame);
  arrived_.time_s = now_s;
  news_.notify_one();
  return true;
}

bool DvStreamCamera::Await(double until_s, CameraFrame& next) {
  std::unique_lock lock(mutex_);
  const double left_s = std::max(0.0, until_s - clock_());
  if (!news_.wait_for(lock, std::chrono::duration<double>(left_s),
                      [this] { return !arrived_.frame.empty(); })) {
    return false;
  }
  raw_ = std::exchange(arrived_.frame, {});
  next.time_s = arrived_.time_s;
  next.sequence = arrived_.sequence;
  return true;
}

CameraResult DvStreamCamera::OnNoFrame(double timeout_s) {
  std::unique_lock lock(mutex_);
  const bool silent = clock_() - arrived_.last_byte_s > kFifoSilence_s;
  const bool damaged = arrived_.damaged > std::exchange(reported_damaged_, arrived_.damaged);
  if (damaged && problem_.empty())
    problem_ = fmt::format("{}: {}", options_.fifo, arrived_.why_damaged);
  const std::uint64_t skipped = arrived_.skipped - reported_skipped_;
  if (skipped >= kUnreadableBytes) {
    reported_skipped_ = arrived_.skipped;
    if (problem_.empty()) {
      problem_ = fmt::format(
          "{}: unreadable data: no DV frame in {} bytes. Check that raw DV is written to this "
          "FIFO, "
          "not AVI, HDV or another format.",
          options_.fifo, skipped);
    }
  }
  lock.unlock();
  if (silent) {
    Close();
    back_off_.Failed(clock_());
    problem_ = fmt::format(
        "{}: no data for {:g} s. Check that the camcorder is on and that the program which writes "
        "DV frames to this FIFO is running.",
        options_.fifo, kFifoSilence_s);
    return CameraResult::kLost;
  }
  if (!problem_.empty()) return CameraResult::kUnusable;
  problem_ = fmt::format("{}: no frame within {:g} s", options_.fifo, timeout_s);
  return CameraResult::kNoFrame;
}

CameraResult DvStreamCamera::Read(double timeout_s, CameraFrame& frame) {
  if (!fifo_) {
    if (!back_off_.Due(clock_())) return CameraResult::kWaiting;
    if (const auto opened = Open(); !opened) {
      back_off_.Failed(clock_());
      problem_ = fmt::format("{}: {}", options_.fifo, opened.error());
      return CameraResult::kLost;
    }
  }
  problem_.clear();
  has_picture_ = false;
  const double until_s = clock_() + std::clamp(timeout_s, 0.0, kMaxFifoWait_s);
  CameraFrame next;
  while (Await(until_s, next)) {
    const auto field = decoder_.Decode(raw_);
    if (!field) {
      problem_ = fmt::format("{}: {}", options_.fifo, field.error());
      continue;
    }
    field_ = *field;
    has_picture_ = true;
    back_off_.Well();
    problem_.clear();
    identity_ = {options_.serial.empty() ? "dv@" + options_.fifo : options_.serial,
                 DvDecoder::ModeTextOf(field_.format)};
    next.luma = SquareLuma(field_, field_luma_, luma_);
    frame = next;
    return CameraResult::kFrame;
  }
  return OnNoFrame(timeout_s);
}

std::vector<std::string> DvStreamCamera::TakeRemarks() {
  std::vector<std::string> remarks = decoder_.TakeRemarks();
  for (std::string& remark : remarks) remark = fmt::format("{}: {}", options_.fifo, remark);
  return remarks;
}

const std::vector<std::uint8_t>* DvStreamCamera::Bgr() {
  if (!has_picture_) return nullptr;
  SquareBgr(field_, bgr_);
  return &bgr_;
}

}  // namespace plumbline::camera
