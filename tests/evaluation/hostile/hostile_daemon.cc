#include "tests/evaluation/hostile/hostile_daemon.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <bit>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <stdexcept>

#include "tests/evaluation/hostile/hostile_robot.h"
#include "tests/port_file.h"

namespace hostile {
namespace {

constexpr double kSlower = 10;         ///< timeout of 100 ms
constexpr double kStaleAfter_s = 0.4;  ///< as in plumbline.toml below
constexpr double kSlack_s = 0.1;       ///< cycle, answer and a busy machine

const char* const kKinds[] = {
    "answers correctly",
    "pauses for 2.5 timeouts once in 41 requests",
    "always 2.8 timeouts late",
    "answers of the robot with unit id 2",
    "header length 2 too large, other robot",
};

double Now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

const double g_start_s = Now_s();

double SinceStart_s() {
  return Now_s() - g_start_s;
}

/// A folder with the configuration, and the daemon in it.
class Daemon {
 public:
  Daemon(const std::string& program, const HostileRobot& robot, bool serial, bool one_block) {
    std::string pattern = std::filesystem::temp_directory_path() / "plumbline-hostile-XXXXXX";
    if (mkdtemp(pattern.data()) == nullptr) throw std::runtime_error("no temporary folder");
    folder_ = pattern;
    WriteFiles(robot, serial, one_block);
    const std::string file = folder_ + "/plumbline.toml", log = folder_ + "/log",
                      ports = folder_ + "/ports";
    pid_ = fork();
    if (pid_ != 0) {
      port_ = plumbline::test::AwaitPort(ports, "plc", [this] { return Runs(); });
      return;
    }
    const int out = open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
    dup2(out, STDOUT_FILENO);
    dup2(out, STDERR_FILENO);
    execl(program.c_str(), program.c_str(), "--config", file.c_str(), "--port-file", ports.c_str(),
          nullptr);
    _exit(127);
  }
  ~Daemon() {
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
    std::filesystem::remove_all(folder_);
  }
  Daemon(const Daemon&) = delete;
  Daemon& operator=(const Daemon&) = delete;
  /// 0 if the daemon ended before it wrote its port.
  int port() const { return port_; }

 private:
  /// Leaves an ended daemon for the destructor to reap.
  bool Runs() const {
    siginfo_t ended{};
    return waitid(P_PID, static_cast<id_t>(pid_), &ended, WEXITED | WNOHANG | WNOWAIT) == 0 &&
           ended.si_pid == 0;
  }
  void WriteFiles(const HostileRobot& robot, bool serial, bool one_block) const {
    std::ofstream(folder_ + "/profile.toml") << fmt::format(
        "schema = 1\nname = \"hostile\"\nsource = \"this evaluation\"\n"
        "[[read]]\ntable = \"holding\"\nfirst = 0\ncount = 12\n{}"
        "[[joints]]\ntable = \"holding\"\naddress = [6, 7, 8, 9, 10, 11]\ntype = \"uint16\"\n"
        "scale = 0.1\nunit = \"mrad\"\n"
        "[payload_mass]\ntable = \"holding\"\naddress = [{}]\ntype = \"uint32\"\n"
        "scale = 0.1\nunit = \"g\"\n",
        one_block ? ""
                  : fmt::format("[[read]]\ntable = \"holding\"\nfirst = 100\ncount = {}\n",
                                serial ? 10 : 12),
        one_block ? 0 : 100);
    std::ofstream(folder_ + "/plumbline.toml") << fmt::format(
        "cell = \"{}/config/cells/ur10.toml\"\nstate_directory = \"state\"\n"
        "[robot]\nprofile = \"profile.toml\"\n{}timeout_ms = 100\nstale_after_ms = 400\n"
        "[payload]\nsource = \"robot\"\n[plc]\nlisten = \"127.0.0.1\"\nport = 0\n",
        std::filesystem::current_path().string(),
        serial
            ? fmt::format("transport = \"rtu\"\ndevice = \"{}\"\nbaud = 115200\n", robot.device())
            : fmt::format("host = \"127.0.0.1\"\nport = {}\n", robot.port()));
  }

  std::string folder_;
  int port_ = 0;
  pid_t pid_ = -1;
};

/// One request of 32 registers from 300; nullopt while the daemon does not answer.
class Plc {
 public:
  explicit Plc(int port) : port_(port) {}
  ~Plc() { Close(); }
  Plc(const Plc&) = delete;
  Plc& operator=(const Plc&) = delete;

  std::optional<Bytes> Read() {
    if (fd_ < 0 && !Connect()) return std::nullopt;
    const Bytes request = {0, 1, 0, 0, 0, 6, 1, 3, 300 >> 8, 300 & 0xFF, 0, 32};
    Bytes answer(9 + 64);
    if (send(fd_, request.data(), request.size(), MSG_NOSIGNAL) < 0 ||
        recv(fd_, answer.data(), answer.size(), MSG_WAITALL) != 9 + 64) {
      Close();
      return std::nullopt;
    }
    return answer;
  }

 private:
  bool Connect() {
    fd_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    const timeval limit{1, 0};
    setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof(limit));
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port_));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (connect(fd_, reinterpret_cast<sockaddr*>(&address), sizeof(address)) == 0) return true;
    Close();
    return false;
  }
  void Close() {
    if (fd_ >= 0) close(fd_);
    fd_ = -1;
  }
  int port_;
  int fd_ = -1;
};

struct Count {
  long polls = 0, valid = 0, foreign = 0, older = 0;
};

Count Poll(const std::string& plumblined, const Kind& kind, bool serial, bool one_block,
           double seconds) {
  const Ticks ticks = [] { return static_cast<std::uint32_t>(1e4 * SinceStart_s()); };
  const HostileRobot robot(kind, serial, ticks, 1, kSlower);
  const Daemon daemon(plumblined, robot, serial, one_block);
  Plc plc(daemon.port());
  Count count;
  for (const double end_s = Now_s() + seconds; Now_s() < end_s;) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    const auto answer = plc.Read();
    const double now_s = SinceStart_s();
    if (!answer) continue;
    ++count.polls;
    const auto word = [&answer](std::size_t i) {
      return static_cast<std::uint32_t>((*answer)[9 + 2 * i] << 8 | (*answer)[10 + 2 * i]);
    };
    constexpr std::uint32_t kPlausible = 1, kPayloadKnown = 4;
    if ((word(0) & kPlausible) == 0 || (word(0) & kPayloadKnown) == 0) continue;
    ++count.valid;
    const auto sampled_s = static_cast<double>(std::bit_cast<float>(word(30) << 16 | word(31)));
    count.foreign += sampled_s > now_s + kSlack_s ? 1 : 0;
    count.older += sampled_s < now_s - kStaleAfter_s - kSlack_s ? 1 : 0;
  }
  return count;
}

}  // namespace

long EvaluateDaemon(const std::string& plumblined, double seconds) {
  struct Task {
    Kind kind;
    const char* line;
    bool serial, one_block;
    Count count;
  };
  std::vector<Task> tasks;
  for (const Kind& kind : Kinds()) {
    for (const std::string_view wanted : kKinds) {
      if (kind.name != wanted) continue;
      if (kind.tcp) tasks.push_back({kind, "TCP", false, false, {}});
      if (kind.rtu) tasks.push_back({kind, "RTU", true, false, {}});
      if (kind.rtu) tasks.push_back({kind, "RTU, one block", true, true, {}});
    }
  }
  std::vector<std::thread> threads;
  for (Task& task : tasks) {
    threads.emplace_back([&task, &plumblined, seconds] {
      task.count = Poll(plumblined, task.kind, task.serial, task.one_block, seconds);
    });
  }
  for (std::thread& thread : threads) thread.join();
  fmt::print("{:<53} {:<14} {:>6} {:>6} {:>7} {:>6}\n", "the robot, through plumblined", "line",
             "polls", "valid", "foreign", "older");
  long wrong = 0;
  bool vacuous = false;
  for (const Task& task : tasks) {
    const Count& c = task.count;
    fmt::print("{:<53} {:<14} {:>6} {:>6} {:>7} {:>6}\n", task.kind.name, task.line, c.polls,
               c.valid, c.foreign, c.older);
    wrong += c.foreign + c.older;
    vacuous = vacuous || (task.kind.name == std::string_view(kKinds[0]) && c.valid == 0);
  }
  fmt::print("valid answers to the PLC that are wrong: {} (goal 0){}\n", wrong,
             vacuous ? "; a robot that answers correctly is not valid" : "");
  return vacuous ? -1 : wrong;
}

}  // namespace hostile
