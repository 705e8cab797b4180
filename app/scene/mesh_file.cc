#include "app/scene/mesh_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>

#include "drivers/clock.h"
#include "drivers/files/open_failure.h"
#include "drivers/files/program_beside.h"

namespace plumbline {
namespace {

constexpr int kReaderNice = 5;
constexpr double kEndPatience_s = 1, kGlance_s = 1e-3;
constexpr std::size_t kPiece = 1 << 20;  ///< of the answer, read at a time

/// In the child between fork and exec: system calls only.
[[noreturn]] void BecomeMeshReader(const char* const* arguments, int file, int answer,
                                   pid_t parent) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(127);
  setpriority(PRIO_PROCESS, 0, kReaderNice);
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  // Out of each other's way first, then to their places.
  const int file_copy = fcntl(file, F_DUPFD, 10), answer_copy = fcntl(answer, F_DUPFD, 10);
  const int nothing = open("/dev/null", O_WRONLY);
  dup2(file_copy, STDIN_FILENO);
  dup2(answer_copy, STDOUT_FILENO);
  dup2(nothing, STDERR_FILENO);
  close_range(STDERR_FILENO + 1, ~0U, 0);
  execv(arguments[0], const_cast<char* const*>(arguments));
  _exit(127);
}

double Mebibytes(std::uint64_t bytes) {
  return static_cast<double>(bytes) / (1 << 20);
}

}  // namespace

std::string MeshProgram() {
  return ProgramBeside("plumbline-mesh");
}

MeshReader::MeshReader(MeshLimits limits, std::string program)
    : limits_(limits), program_(std::move(program)) {}

MeshReader::~MeshReader() {
  End(0);
}

std::optional<Error> MeshReader::Start(const std::string& file, double unit_m) {
  const auto format = MeshFormatOfName(file);
  if (!format) return Error{fmt::format("its name ends in none of {}", kMeshFormats)};
  const int opened = open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
  if (opened < 0) return Error{CannotBeRead(file, std::strerror(errno))};
  struct stat about {};
  std::optional<Error> why;
  found_ = {};
  found_.format = *format;
  unit_m_ = unit_m;
  if (fstat(opened, &about) != 0 || !S_ISREG(about.st_mode)) {
    why = Error{"cannot be read: no regular file; name a mesh file, no folder and no device"};
  } else if (about.st_size == 0) {
    why = Error{"is empty"};
  } else if (static_cast<std::uint64_t>(about.st_size) > limits_.file_bytes) {
    why = Error{fmt::format(
        "{:.0f} MiB; the limit is {:.0f} MiB: simplify the model, or export it "
        "coarser",
        Mebibytes(static_cast<std::uint64_t>(about.st_size)), Mebibytes(limits_.file_bytes))};
  } else {
    found_.bytes = static_cast<std::uint64_t>(about.st_size);
    why = StartProcess(opened);
  }
  close(opened);
  return why;
}

std::optional<Error> MeshReader::StartProcess(int file) {
  const std::array<std::string, 5> words = {
      program_, std::string(WordOf(found_.format)), std::to_string(limits_.triangles),
      std::to_string(limits_.memory_bytes), std::to_string(limits_.cpu_s)};
  std::array<const char*, 6> arguments{};
  std::transform(words.begin(), words.end(), arguments.begin(),
                 [](const std::string& word) { return word.c_str(); });
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) {
    return Error{fmt::format("no pipe to its reader: {}", std::strerror(errno))};
  }
  const pid_t parent = getpid();
  const pid_t pid = fork();
  if (pid == 0) BecomeMeshReader(arguments.data(), file, ends[1], parent);
  close(ends[1]);
  if (pid < 0) {
    close(ends[0]);
    return Error{fmt::format("no process to read it: {}", std::strerror(errno))};
  }
  pid_ = pid;
  pipe_ = ends[0];
  fcntl(pipe_, F_SETFL, O_NONBLOCK);
  answer_.clear();
  started_s_ = MonotonicSeconds();
  return std::nullopt;
}

int MeshReader::End(double patience_s) {
  int status = 0;
  if (pid_ > 0) {
    pid_t ended = waitpid(pid_, &status, WNOHANG);
    for (double waited_s = 0; ended == 0 && waited_s < patience_s; waited_s += kGlance_s) {
      SleepSeconds(kGlance_s);
      ended = waitpid(pid_, &status, WNOHANG);
    }
    if (ended == 0) {
      kill(pid_, SIGKILL);
      waitpid(pid_, &status, 0);
    }
  }
  if (pipe_ >= 0) close(pipe_);
  pid_ = pipe_ = -1;
  return status;
}

std::string MeshReader::WhyEnded(int status) const {
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU) {
    return fmt::format("not read within {} s of processor time: simplify the model", limits_.cpu_s);
  }
  if (WIFSIGNALED(status)) {
    return fmt::format(
        "its reader died ({}): the file is damaged, nested too deeply, or needs "
        "more than {:.0f} MiB; repair the model, or export it in another format",
        strsignal(WTERMSIG(status)), Mebibytes(limits_.memory_bytes));
  }
  if (WEXITSTATUS(status) == kMeshOutOfMemory) {
    return fmt::format(
        "reading it takes more than {:.0f} MiB of memory: it is damaged, or too "
        "large",
        Mebibytes(limits_.memory_bytes));
  }
  if (WEXITSTATUS(status) == 127) {
    return fmt::format("{} cannot be started; {}", program_, kRestoreProgram);
  }
  return fmt::format("{} gave no answer that makes sense; is it this version's?", program_);
}

Result<MeshFile> MeshReader::Finish() {
  auto answer = MeshAnswerOfBytes(answer_, limits_);
  answer_ = {};
  // The pipe is at its end, so it is about to exit; if not, it is ended.
  const int status = End(answer ? 0 : kEndPatience_s);
  if (!answer) return Error{WhyEnded(status)};
  if (!*answer) return Error{answer->error()};
  RawMesh raw = std::move(*answer).value();
  auto checked = CheckMesh(std::move(raw.mesh), unit_m_);
  if (!checked) return Error{checked.error()};
  found_.checked = std::move(checked).value();
  found_.other_elements = raw.other_elements;
  found_.outside = std::move(raw.outside);
  found_.outside_count = raw.outside_count;
  return std::move(found_);
}

std::optional<Result<MeshFile>> MeshReader::Poll(double wait_s) {
  if (idle()) return std::nullopt;
  const double until_s = MonotonicSeconds() + wait_s;
  for (;;) {
    const std::size_t before = answer_.size();
    answer_.resize(before + kPiece);
    const ssize_t got = read(pipe_, answer_.data() + before, kPiece);
    answer_.resize(before + static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
    if (answer_.size() > LargestMeshAnswer(limits_)) {
      End(0);
      return Error{fmt::format("{} answers more than it may", program_)};
    }
    if (got == 0) return Finish();
    if (got > 0) continue;
    const double now_s = MonotonicSeconds();
    if (now_s - started_s_ > limits_.wall_s) {
      End(0);
      return Error{fmt::format("not read within {:g} s: simplify the model", limits_.wall_s)};
    }
    if (now_s >= until_s) return std::nullopt;
    pollfd readable{.fd = pipe_, .events = POLLIN, .revents = 0};
    poll(&readable, 1, static_cast<int>(1e3 * std::min(1.0, until_s - now_s)) + 1);
  }
}

Result<MeshFile> ReadMeshFile(const std::string& file, double unit_m, const MeshLimits& limits,
                              const std::string& program) {
  MeshReader reader(limits, program);
  if (auto why = reader.Start(file, unit_m)) return *why;
  for (;;) {
    if (auto answer = reader.Poll(1)) return *std::move(answer);
  }
}

}  // namespace plumbline
