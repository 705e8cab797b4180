#include "app/camera/board_worker.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>

#include "app/camera/board_message.h"
#include "app/lens/board_detection.h"

namespace plumbline {
namespace {

constexpr int kSocket = 3, kMemory = 4;  ///< the worker's descriptors
constexpr int kWorkerNice = 5;

/// In the child between fork and exec: system calls only.
[[noreturn]] void BecomeWorker(const char* program, int socket, int memory, pid_t parent) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(127);
  setpriority(PRIO_PROCESS, 0, kWorkerNice);
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  // Out of each other's way first, then to their places.
  const int socket_copy = fcntl(socket, F_DUPFD, 10), memory_copy = fcntl(memory, F_DUPFD, 10);
  dup2(socket_copy, kSocket);
  dup2(memory_copy, kMemory);
  const int nothing = open("/dev/null", O_RDWR);
  for (const int standard : {STDIN_FILENO, STDOUT_FILENO}) dup2(nothing, standard);
  close_range(kMemory + 1, ~0U, 0);
  execl(program, program, "board-worker", nullptr);
  _exit(127);
}

}  // namespace

BoardWorker::BoardWorker(std::string program, Clock clock)
    : program_(std::move(program)), clock_(clock) {}

BoardWorker::~BoardWorker() {
  End();
  if (shared_ != nullptr) munmap(shared_, shared_bytes_);
  if (memory_ >= 0) close(memory_);
}

std::optional<Error> BoardWorker::Start() {
  std::array<int, 2> pair{};
  if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, pair.data()) != 0) {
    return Error{fmt::format("no socket for the worker: {}", std::strerror(errno))};
  }
  const int room = static_cast<int>(kLargestBoardMessage);
  setsockopt(pair[1], SOL_SOCKET, SO_SNDBUF, &room, sizeof room);
  const pid_t parent = getpid();
  const pid_t pid = fork();
  if (pid == 0) BecomeWorker(program_.c_str(), pair[1], memory_, parent);
  close(pair[1]);
  if (pid < 0) {
    close(pair[0]);
    return Error{fmt::format("no process for the worker: {}", std::strerror(errno))};
  }
  pid_ = pid;
  socket_ = pair[0];
  answered_ = false;
  return std::nullopt;
}

void BoardWorker::End() {
  if (pid_ > 0) {
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
    pid_ = -1;
  }
  if (socket_ >= 0) close(socket_);
  socket_ = -1;
  asked_s_.reset();
}

std::optional<Error> BoardWorker::Share(const LumaView& image) {
  const std::size_t bytes = static_cast<std::size_t>(image.width) * image.height;
  if (bytes > shared_bytes_) {
    End();  // it has mapped the smaller memory
    if (shared_ != nullptr) munmap(shared_, shared_bytes_);
    if (memory_ >= 0) close(memory_);
    shared_ = nullptr;
    shared_bytes_ = 0;
    memory_ = memfd_create("plumbline-board", MFD_CLOEXEC);
    void* at = MAP_FAILED;
    if (memory_ >= 0 && ftruncate(memory_, static_cast<off_t>(bytes)) == 0) {
      at = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, memory_, 0);
    }
    if (at == MAP_FAILED) {
      return Error{fmt::format("no memory for the worker's frames: {}", std::strerror(errno))};
    }
    shared_ = static_cast<std::uint8_t*>(at);
    shared_bytes_ = bytes;
  }
  for (int v = 0; v < image.height; ++v) {
    std::memcpy(shared_ + static_cast<std::size_t>(v) * image.width, image.row(v),
                static_cast<std::size_t>(image.width));
  }
  return std::nullopt;
}

std::optional<Error> BoardWorker::Ask(const LumaView& image, const Board& board) {
  if (auto why = Share(image)) return why;
  if (pid_ < 0) {
    if (auto why = Start()) return why;
  }
  const Bytes request = BytesOfRequest({image.width, image.height, board});
  if (send(socket_, request.data(), request.size(), MSG_NOSIGNAL | MSG_DONTWAIT) < 0) {
    const std::string why = std::strerror(errno);
    ++ended_;
    End();
    return Error{"the worker does not listen: " + why};
  }
  asked_s_ = clock_();
  points_ = static_cast<std::size_t>(board.corners());
  return std::nullopt;
}

Result<BoardView> BoardWorker::Failed(const std::string& why) {
  ++ended_;
  End();
  return Error{why};
}

std::optional<Result<BoardView>> BoardWorker::Poll() {
  if (!asked_s_) return std::nullopt;
  Bytes bytes(kLargestBoardMessage);
  const ssize_t got = recv(socket_, bytes.data(), bytes.size(), MSG_DONTWAIT);
  if (got < 0 && (errno == EAGAIN || errno == EINTR)) {
    const double spent_s = clock_() - *asked_s_;
    if (spent_s < (answered_ ? kDeadline_s : kStart_s)) return std::nullopt;
    return Failed(fmt::format("the board was not looked for within {:.1f} s; ended", spent_s));
  }
  if (got <= 0) return Failed(program_ + " board-worker ended; is it this version's plumbline?");
  bytes.resize(static_cast<std::size_t>(got));
  auto answer = AnswerOfBytes(bytes);
  if (!answer || (*answer && (*answer)->corners_px.size() != points_)) {
    return Failed("the worker's answer makes no sense");
  }
  answered_ = true;
  asked_s_.reset();
  return answer;
}

int RunBoardWorker() {
  const std::uint8_t* shared = nullptr;
  std::size_t mapped = 0;
  for (;;) {
    std::array<std::uint8_t, kLargestBoardRequest> bytes{};
    const ssize_t got = recv(kSocket, bytes.data(), bytes.size(), 0);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return got == 0 ? 0 : 1;
    const auto request = RequestOfBytes(std::span(bytes).first(static_cast<std::size_t>(got)));
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
    const LumaView image{shared, request->width, request->height, request->width};
    const Bytes answer = BytesOfAnswer(DetectBoard(image, request->board));
    if (send(kSocket, answer.data(), answer.size(), MSG_NOSIGNAL) < 0) return 1;
  }
}

}  // namespace plumbline
