#include "drivers/os/run_program.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <sstream>

#include "drivers/clock.h"
#include "drivers/os/descriptor.h"

namespace plumbline::os {
namespace {

struct Pipe {
  Descriptor read, write;

  bool Open() {
    std::array<int, 2> ends{};
    if (pipe2(ends.data(), O_CLOEXEC) != 0) return false;
    read.Reset(ends[0]);
    write.Reset(ends[1]);
    return true;
  }
};

/// Blocks SIGPIPE in this thread: writing to a program that has stopped reading then fails with
/// EPIPE.
class PipeSignalBlocked {
 public:
  PipeSignalBlocked() {
    sigemptyset(&pipe_);
    sigaddset(&pipe_, SIGPIPE);
    sigset_t pending;
    sigpending(&pending);
    was_pending_ = sigismember(&pending, SIGPIPE) == 1;
    pthread_sigmask(SIG_BLOCK, &pipe_, &before_);
  }
  ~PipeSignalBlocked() {
    const timespec now{};
    while (!was_pending_ && sigtimedwait(&pipe_, nullptr, &now) < 0 && errno == EINTR) {
    }
    pthread_sigmask(SIG_SETMASK, &before_, nullptr);
  }
  PipeSignalBlocked(const PipeSignalBlocked&) = delete;
  PipeSignalBlocked& operator=(const PipeSignalBlocked&) = delete;

 private:
  sigset_t pipe_{}, before_{};
  bool was_pending_ = false;
};

std::string LimitText(const char* what, double limit, const char* unit) {
  std::ostringstream text;
  text << what << ' ' << limit << ' ' << unit;
  return text.str();
}

/// Appends available data; closes the descriptor at the end of the stream.
void ReadAvailable(Descriptor& from, std::string& text) {
  std::array<char, 65536> buffer;
  const ssize_t count = read(from.get(), buffer.data(), buffer.size());
  if (count > 0) text.append(buffer.data(), static_cast<std::size_t>(count));
  if (count == 0 || (count < 0 && errno != EAGAIN && errno != EINTR)) from.Reset();
}

/// Writes as much as the pipe accepts; closes it when all is written, or if nobody reads it.
void WriteAvailable(Descriptor& to, std::string_view& input) {
  const ssize_t count = input.empty() ? 0 : write(to.get(), input.data(), input.size());
  if (count > 0) input.remove_prefix(static_cast<std::size_t>(count));
  if (input.empty() || (count < 0 && errno != EAGAIN && errno != EINTR)) to.Reset();
}

/// Transfers data until both outputs end. @return  the limit that was exceeded; empty: none
std::string Exchange(Pipe& in, Pipe& out, Pipe& errors, std::string_view input,
                     const RunLimits& limits, ProgramRun& run) {
  const double until_s = MonotonicSeconds() + limits.time_s;
  while (out.read || errors.read) {
    const double left_s = until_s - MonotonicSeconds();
    if (left_s <= 0) return LimitText("did not end within", limits.time_s, "s");
    if (run.output.size() + run.errors.size() > limits.output_bytes) {
      return LimitText("wrote more than", std::ldexp(limits.output_bytes, -20), "MiB");
    }
    std::array<pollfd, 3> polled{{{out.read.get(), POLLIN, 0},
                                  {errors.read.get(), POLLIN, 0},
                                  {in.write.get(), POLLOUT, 0}}};
    if (poll(polled.data(), polled.size(), static_cast<int>(1e3 * left_s) + 1) < 0) continue;
    if (polled[0].revents != 0) ReadAvailable(out.read, run.output);
    if (polled[1].revents != 0) ReadAvailable(errors.read, run.errors);
    if (polled[2].revents != 0) WriteAvailable(in.write, input);
  }
  return "";
}

}  // namespace

Result<ProgramRun> RunProgram(const std::vector<std::string>& arguments, std::string_view input,
                              const RunLimits& limits) {
  const PipeSignalBlocked blocked;
  Pipe in, out, errors;
  if (!in.Open() || !out.Open() || !errors.Open()) {
    return Error{std::string("cannot be started: ") + std::strerror(errno)};
  }
  auto child = ChildProcess::Start({.arguments = arguments,
                                    .descriptors = {{STDIN_FILENO, in.read.get()},
                                                    {STDOUT_FILENO, out.write.get()},
                                                    {STDERR_FILENO, errors.write.get()}}});
  if (!child) return Error{"cannot be started: " + child.error()};
  in.read.Reset();
  out.write.Reset();
  errors.write.Reset();
  for (const int fd : {in.write.get(), out.read.get(), errors.read.get()}) {
    fcntl(fd, F_SETFL, O_NONBLOCK);
  }
  const double started_s = MonotonicSeconds();
  ProgramRun run;
  const std::string exceeded = Exchange(in, out, errors, input, limits, run);
  if (!exceeded.empty()) return Error{exceeded};
  // Both outputs are closed, so the program is about to exit.
  run.end = child.value().End(limits.time_s - (MonotonicSeconds() - started_s));
  return run;
}

}  // namespace plumbline::os
