#include "app/vision/camera/board_worker.h"

#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "app/vision/camera/board_message.h"
#include "app/vision/lens/board_detection.h"

namespace plumbline::vision {
namespace {

constexpr int kSocket = 3, kMemory = 4;  ///< descriptors the worker inherits
constexpr int kWorkerNice = 5;

}  // namespace

BoardWorker::BoardWorker(std::string program, Clock clock)
    : program_(std::move(program)), clock_(clock) {}

BoardWorker::~BoardWorker() {
  StopWorker();
  if (shared_ != nullptr) munmap(shared_, shared_bytes_);
}

Result<void> BoardWorker::Start() {
  std::array<int, 2> pair{};
  if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, pair.data()) != 0) {
    return Error{
        fmt::format("cannot create a socket for the board worker: {}", std::strerror(errno))};
  }
  os::Descriptor ours(pair[0]);
  const os::Descriptor its(pair[1]);
  const int room = static_cast<int>(kMaxBoardResponse_bytes);
  setsockopt(its.get(), SOL_SOCKET, SO_SNDBUF, &room, sizeof room);
  auto child = os::ChildProcess::Start({.arguments = {program_, "board-worker"},
                                        .descriptors = {{STDERR_FILENO, STDERR_FILENO},
                                                        {kSocket, its.get()},
                                                        {kMemory, memory_.get()}},
                                        .nice = kWorkerNice});
  if (!child) return Error{fmt::format("cannot start the board worker: {}", child.error())};
  child_ = std::move(child).value();
  socket_ = std::move(ours);
  has_responded_ = false;
  return {};
}

void BoardWorker::StopWorker() {
  child_.End();
  socket_.Reset();
  sent_s_.reset();
}

Result<void> BoardWorker::CopyToSharedMemory(const image::LumaView& image) {
  const std::size_t bytes = static_cast<std::size_t>(image.width) * image.height;
  if (bytes > shared_bytes_) {
    StopWorker();  // it has mapped the smaller memory
    if (shared_ != nullptr) munmap(shared_, shared_bytes_);
    shared_ = nullptr;
    shared_bytes_ = 0;
    memory_.Reset(memfd_create("plumbline-board", MFD_CLOEXEC));
    void* at = MAP_FAILED;
    if (memory_ && ftruncate(memory_.get(), static_cast<off_t>(bytes)) == 0) {
      at = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, memory_.get(), 0);
    }
    if (at == MAP_FAILED) {
      return Error{fmt::format("cannot allocate shared memory for the board worker's frames: {}",
                               std::strerror(errno))};
    }
    shared_ = static_cast<std::uint8_t*>(at);
    shared_bytes_ = bytes;
  }
  for (int v = 0; v < image.height; ++v) {
    std::memcpy(shared_ + static_cast<std::size_t>(v) * image.width, image.row(v),
                static_cast<std::size_t>(image.width));
  }
  return {};
}

Result<void> BoardWorker::Submit(const image::LumaView& image, const target::Board& board) {
  if (auto shared = CopyToSharedMemory(image); !shared) return shared;
  if (!child_.started()) {
    if (auto started = Start(); !started) return started;
  }
  const Bytes request = EncodeRequest({image.width, image.height, board});
  if (send(socket_.get(), request.data(), request.size(), MSG_NOSIGNAL | MSG_DONTWAIT) < 0) {
    const std::string why = std::strerror(errno);
    ++failures_;
    StopWorker();
    return Error{"cannot send to the board worker: " + why};
  }
  sent_s_ = clock_();
  expected_points_ = static_cast<std::size_t>(board.corners());
  return {};
}

Result<BoardView> BoardWorker::Fail(const std::string& why) {
  ++failures_;
  StopWorker();
  return Error{why};
}

std::optional<Result<BoardView>> BoardWorker::Poll() {
  if (!sent_s_) return std::nullopt;
  Bytes bytes(kMaxBoardResponse_bytes);
  const ssize_t got = recv(socket_.get(), bytes.data(), bytes.size(), MSG_DONTWAIT);
  if (got < 0 && (errno == EAGAIN || errno == EINTR)) {
    const double spent_s = clock_() - *sent_s_;
    if (spent_s < (has_responded_ ? kDeadline_s : kStartupDeadline_s)) return std::nullopt;
    return Fail(
        fmt::format("board detection did not finish within {:.1f} s; worker restarted", spent_s));
  }
  if (got <= 0)
    return Fail(program_ +
                " board-worker exited unexpectedly; check that it is this version's plumbline");
  bytes.resize(got);
  auto response = DecodeResponse(bytes);
  if (!response || (*response && (*response)->corners_px.size() != expected_points_)) {
    return Fail("the board worker sent a malformed response");
  }
  has_responded_ = true;
  sent_s_.reset();
  return response;
}

int RunBoardWorker() {
  const std::uint8_t* shared = nullptr;
  std::size_t mapped = 0;
  for (;;) {
    std::array<std::uint8_t, kMaxBoardRequest_bytes> bytes{};
    const ssize_t got = recv(kSocket, bytes.data(), bytes.size(), 0);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return got == 0 ? 0 : 1;
    const auto request = DecodeRequest(std::span(bytes).first(got));
    if (!request) return 1;
    struct stat about {};
    if (fstat(kMemory, &about) != 0) return 1;
    const auto size = static_cast<std::size_t>(about.st_size);
    if (shared == nullptr) {
      void* const at = mmap(nullptr, size, PROT_READ, MAP_SHARED, kMemory, 0);
      if (at == MAP_FAILED) return 1;
      shared = static_cast<const std::uint8_t*>(at);
      mapped = size;
    }
    if (static_cast<std::size_t>(request->width) * request->height > mapped) return 1;
    const image::LumaView image{shared, request->width, request->height, request->width};
    const Bytes response = EncodeResponse(DetectBoard(image, request->board));
    if (send(kSocket, response.data(), response.size(), MSG_NOSIGNAL) < 0) return 1;
  }
}

}  // namespace plumbline::vision
