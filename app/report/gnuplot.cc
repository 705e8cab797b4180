#include "app/report/gnuplot.h"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <regex>
#include <thread>

#include "app/report/html.h"

namespace plumbline {
namespace {

constexpr int kNotFound = 127;
// Doubled quotes, gnuplot's own way, are misread at the start of a string.
constexpr const char* kApostrophe = "\u2019";
constexpr std::size_t kMostOutput = std::size_t{64} << 20;

/// A file descriptor that closes itself.
class Descriptor {
 public:
  explicit Descriptor(int fd = -1) : fd_(fd) {}
  ~Descriptor() { Close(); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  void Reset(int fd) {
    Close();
    fd_ = fd;
  }
  void Close() {
    if (fd_ >= 0) close(fd_);
    fd_ = -1;
  }
  int get() const { return fd_; }

 private:
  int fd_;
};

struct Pipe {
  Descriptor read, write;

  bool Open() {
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) return false;
    read.Reset(ends[0]);
    write.Reset(ends[1]);
    return true;
  }
};

/// Keeps SIGPIPE from ending this process while a child may stop reading.
class PipeSignalIgnored {
 public:
  PipeSignalIgnored() {
    struct sigaction ignore {};
    ignore.sa_handler = SIG_IGN;
    sigaction(SIGPIPE, &ignore, &old_);
  }
  ~PipeSignalIgnored() { sigaction(SIGPIPE, &old_, nullptr); }
  PipeSignalIgnored(const PipeSignalIgnored&) = delete;
  PipeSignalIgnored& operator=(const PipeSignalIgnored&) = delete;

 private:
  struct sigaction old_ {};
};

/// A child with pipes at its three standard streams.
class Child {
 public:
  ~Child() {
    if (pid_ > 0) {
      kill(pid_, SIGKILL);
      waitpid(pid_, nullptr, 0);
    }
  }

  /// 0, or the error number.
  int Start(const std::string& program) {
    if (!in_.Open() || !out_.Open() || !err_.Open()) return errno;
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, in_.read.get(), STDIN_FILENO);
    posix_spawn_file_actions_adddup2(&actions, out_.write.get(), STDOUT_FILENO);
    posix_spawn_file_actions_adddup2(&actions, err_.write.get(), STDERR_FILENO);
    posix_spawnattr_t attributes;
    posix_spawnattr_init(&attributes);
    sigset_t defaults;
    sigemptyset(&defaults);
    sigaddset(&defaults, SIGPIPE);
    posix_spawnattr_setsigdefault(&attributes, &defaults);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGDEF);
    std::string name = program, no_settings = "-d", from_stdin = "-";
    char* arguments[] = {name.data(), no_settings.data(), from_stdin.data(), nullptr};
    const int failed =
        posix_spawnp(&pid_, program.c_str(), &actions, &attributes, arguments, environ);
    posix_spawn_file_actions_destroy(&actions);
    posix_spawnattr_destroy(&attributes);
    if (failed != 0) pid_ = -1;
    in_.read.Close();
    out_.write.Close();
    err_.write.Close();
    fcntl(in_.write.get(), F_SETFL, O_NONBLOCK);
    return failed;
  }

  /// Feeds the script and gathers what is written until both outputs end.
  /// @return false where the time ran out, or the output grew beyond all measure
  bool Exchange(std::string_view script, std::chrono::steady_clock::time_point deadline) {
    std::string* const texts[] = {&output, &complaint};
    Descriptor* const ends[] = {&out_.read, &err_.read};
    if (script.empty()) in_.write.Close();
    while (ends[0]->get() >= 0 || ends[1]->get() >= 0) {
      const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(
          deadline - std::chrono::steady_clock::now());
      if (left.count() <= 0 || output.size() > kMostOutput) return false;
      pollfd polled[] = {
          {ends[0]->get(), POLLIN, 0}, {ends[1]->get(), POLLIN, 0}, {in_.write.get(), POLLOUT, 0}};
      if (poll(polled, 3, static_cast<int>(left.count())) < 0 && errno != EINTR) return false;
      for (int k = 0; k < 2; ++k) {
        if ((polled[k].revents & (POLLIN | POLLHUP | POLLERR)) == 0) continue;
        char buffer[65536];
        const ssize_t count = read(ends[k]->get(), buffer, sizeof buffer);
        if (count > 0) texts[k]->append(buffer, static_cast<std::size_t>(count));
        if (count == 0) ends[k]->Close();
      }
      if (polled[2].revents != 0) {
        const ssize_t count = write(in_.write.get(), script.data(), script.size());
        if (count > 0) script.remove_prefix(static_cast<std::size_t>(count));
        if (script.empty() || (count < 0 && errno != EAGAIN && errno != EINTR)) in_.write.Close();
      }
    }
    return true;
  }

  int Wait() {
    int status = 0;
    while (waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
    }
    pid_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

  std::string output, complaint;

 private:
  pid_t pid_ = -1;
  Pipe in_, out_, err_;
};

void EraseAll(std::string& text, const std::string& pattern) {
  for (auto at = text.find(pattern); at != std::string::npos; at = text.find(pattern, at)) {
    text.erase(at, pattern.size());
  }
}

void ReplaceAll(std::string& text, const std::string& from, const std::string& to) {
  for (auto at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size())) {
    text.replace(at, from.size(), to);
  }
}

/// Takes out everything from `open` to `close`, both included.
void EraseBetween(std::string& text, const std::string& open, const std::string& close) {
  for (auto at = text.find(open); at != std::string::npos; at = text.find(open, at)) {
    const auto end = text.find(close, at);
    if (end == std::string::npos) return;
    text.erase(at, end + close.size() - at);
  }
}

}  // namespace

Result<std::vector<std::string>> DrawSvgs(const std::string& script,
                                          const GnuplotOptions& options) {
  const PipeSignalIgnored ignored;
  Child child;
  const int failed = child.Start(options.program);
  if (failed == ENOENT) {
    return Error{options.program + " is not installed (Debian package gnuplot-nox)"};
  }
  if (failed != 0) return Error{options.program + " cannot be started: " + std::strerror(failed)};
  if (!child.Exchange(script, std::chrono::steady_clock::now() + options.limit)) {
    return Error{options.program + " did not end in its time"};
  }
  const int status = child.Wait();
  if (status == kNotFound) return Error{options.program + " cannot be started"};
  std::vector<std::string> documents;
  const std::string end = "</svg>";
  std::size_t at = 0;
  for (auto found = child.output.find(end); found != std::string::npos;
       found = child.output.find(end, at)) {
    documents.push_back(child.output.substr(at, found + end.size() - at));
    at = found + end.size();
  }
  if (status != 0) {
    return Error{options.program + " failed: " + child.complaint.substr(0, 400)};
  }
  return documents;
}

std::string GnuplotQuoted(std::string_view text) {
  std::string quoted = "'";
  for (const char c : ValidUtf8(text)) {
    if (c == '\'') {
      quoted += kApostrophe;
    } else {
      quoted += static_cast<unsigned char>(c) < 0x20 || c == 0x7f ? ' ' : c;
    }
  }
  return quoted + '\'';
}

std::string InlineSvg(const std::string& document, const std::string& id,
                      const std::string& title) {
  const auto start = document.find("<svg");
  if (start == std::string::npos) return "";
  std::string svg = document.substr(start);
  EraseBetween(svg, "<!--", "-->");
  EraseBetween(svg, "<title>", "</title>");
  EraseBetween(svg, "<desc>", "</desc>");
  EraseBetween(svg, " font-family=\"", "\"");
  EraseAll(svg, " xmlns=\"http://www.w3.org/2000/svg\"");
  EraseAll(svg, " xmlns:xlink=\"http://www.w3.org/1999/xlink\"");
  // gnuplot quotes ids in either way.
  ReplaceAll(svg, " id=\"", " id=\"" + id + "-");
  ReplaceAll(svg, " id='", " id='" + id + "-");
  ReplaceAll(svg, "xlink:href='#", "href='#" + id + "-");
  ReplaceAll(svg, "xlink:href=\"#", "href=\"#" + id + "-");
  ReplaceAll(svg, "url(#", "url(#" + id + "-");
  const auto head = svg.find('>');
  const std::string attributes = svg.substr(4, head - 4);
  std::smatch box;
  const std::regex view_box("viewBox=\"([0-9. ]+)\"");
  const std::string kept = std::regex_search(attributes, box, view_box)
                               ? " viewBox=\"" + box[1].str() + "\""
                               : attributes;
  return "<svg role=\"img\" aria-label=\"" + Escape(title) + "\"" + kept + svg.substr(head);
}

}  // namespace plumbline
