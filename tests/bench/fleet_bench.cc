// Benchmark of the publisher: forwarding an hour of queued messages to Mosquitto, and the idle
// load. fleet_bench PLUMBLINE_FLEET CONFIG
#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <mosquitto.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>

#include "app/fleet/change_detector.h"
#include "app/fleet/queue.h"
#include "app/view_link/view_publisher.h"
#include "drivers/clock.h"
#include "firmware-like/snapshot.h"

using namespace plumbline;

namespace {

constexpr double kHour_s = 3600, kFeedPeriod_s = 0.2, kIdle_s = 10;
constexpr int kPoints = 10, kProbesPerHour = 60;

pid_t Start(const std::vector<std::string>& command, const std::string& log,
            const std::string& input = "/dev/null") {
  const pid_t child = fork();
  if (child != 0) return child;
  dup2(open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0644), STDERR_FILENO);
  dup2(STDERR_FILENO, STDOUT_FILENO);
  dup2(open(input.c_str(), O_RDONLY), STDIN_FILENO);
  std::vector<char*> words;
  for (const std::string& word : command) words.push_back(const_cast<char*>(word.c_str()));
  words.push_back(nullptr);
  execvp(words[0], words.data());
  _exit(127);
}

/// Child process, terminated when the object is destroyed.
class Child {
 public:
  explicit Child(pid_t pid) : pid_(pid) {}
  ~Child() { End(); }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;
  pid_t pid() const { return pid_; }
  void Wait() {
    waitpid(pid_, nullptr, 0);
    pid_ = -1;
  }
  void End() {
    if (pid_ <= 0) return;
    kill(pid_, SIGTERM);
    Wait();
  }

 private:
  pid_t pid_;
};

struct Folder {
  const std::string path;
  ~Folder() {
    std::error_code failed;
    std::filesystem::remove_all(path, failed);
  }
};

int FreePort() {
  const int descriptor = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  const bool bound = bind(descriptor, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0 &&
                     getsockname(descriptor, reinterpret_cast<sockaddr*>(&address), &size) == 0;
  close(descriptor);
  return bound ? ntohs(address.sin_port) : 0;
}

/// Counts messages below a topic, with the times of the first and the last.
struct Counter {
  std::atomic<std::size_t> count{0};
  std::atomic<double> first_s{0}, newest_s{0};

  void Take() {
    const double now_s = MonotonicSeconds();
    if (count == 0) first_s = now_s;
    newest_s = now_s;
    ++count;
  }
};

/// Two points move every minute, an alarm is raised and cleared every two minutes.
view_link::ViewState StateAt(double time_s) {
  view_link::ViewState state;
  state.utc_s = 1.8e9 + time_s;
  state.model_version = 3;
  state.status = status::kReady | status::kRobotLink;
  state.q = model::JointVector::Constant(6, 0.3);
  state.payload_kg = 60;
  state.temp_C = 24.5;
  const int minute = static_cast<int>(time_s / 60);
  if (minute % 2 == 1 && time_s - 60 * minute < 20) state.alarms = alarm::kRobotStale;
  for (int k = 0; k < kPoints; ++k) {
    view_link::ViewPoint point;
    point.id = k + 1;
    point.valid = true;
    point.code = correction::CorrectionCode::kOk;
    if (k < 2) point.translation_B.x() = 1e-3 * minute;
    state.points.push_back(point);
  }
  return state;
}

std::vector<fleet::Message> MessagesOfOneHour() {
  config::MqttConfig config;
  fleet::FleetCell cell{"bench", "cell", "bench", std::vector<model::Joint>(6), {}};
  fleet::ChangeDetector changes(config, cell, "");
  std::vector<fleet::Message> messages;
  int probes = 0;
  for (double time_s = 0; time_s < kHour_s; time_s += kFeedPeriod_s) {
    for (fleet::Message& message : changes.Update(StateAt(time_s), time_s)) {
      messages.push_back(std::move(message));
    }
    if (time_s < kHour_s * probes / kProbesPerHour) continue;
    fleet::ProbeRow probe;
    probe.id = ++probes;
    probe.measured_W = probe.predicted_W = Vec3::Zero();
    messages.push_back({fleet::MessageKind::kProbe, 1, fleet::ProbeBody(probe)});
  }
  return messages;
}

double CpuSeconds(pid_t process) {
  std::ifstream file(fmt::format("/proc/{}/stat", process));
  std::string text((std::istreambuf_iterator<char>(file)), {});
  std::istringstream rest(text.substr(text.rfind(')') + 2));
  std::string word;
  for (int k = 0; k < 11; ++k) rest >> word;
  double user = 0, system = 0;
  rest >> user >> system;
  return (user + system) / static_cast<double>(sysconf(_SC_CLK_TCK));
}

double ResidentMB(pid_t process) {
  std::ifstream file(fmt::format("/proc/{}/statm", process));
  double pages = 0, resident = 0;
  file >> pages >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) * 1e-6;
}

template <typename Condition>
bool Within(double seconds, Condition holds) {
  const double until_s = MonotonicSeconds() + seconds;
  while (MonotonicSeconds() < until_s) {
    if (holds()) return true;
    SleepSeconds(0.005);
  }
  return false;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  if (access("/usr/sbin/mosquitto", X_OK) != 0) {
    fmt::print("SKIPPED: mosquitto is not installed (apt install mosquitto)\n");
    return 0;
  }
  char pattern[] = "/tmp/plumbline-bench-XXXXXX";
  const Folder own{mkdtemp(pattern)};
  const std::string folder = own.path, log = folder + "/log";
  const int port = FreePort();
  std::ofstream(folder + "/mosquitto.conf")
      << "listener " << port << " 127.0.0.1\nallow_anonymous true\nmax_queued_messages 0\n";
  const Child broker(Start({"/usr/sbin/mosquitto", "-c", folder + "/mosquitto.conf"}, log));

  mosquitto_lib_init();
  Counter counter;
  mosquitto* const client = mosquitto_new(nullptr, true, &counter);
  mosquitto_message_callback_set(client, [](mosquitto*, void* to, const mosquitto_message*) {
    static_cast<Counter*>(to)->Take();
  });
  if (!Within(10, [&] { return mosquitto_connect(client, "127.0.0.1", port, 60) == 0; })) return 1;
  mosquitto_loop_start(client);
  mosquitto_subscribe(client, nullptr, "+/bench/+/#", 1);
  SleepSeconds(0.5);

  const std::vector<fleet::Message> messages = MessagesOfOneHour();
  std::size_t bytes = 0;
  std::filesystem::create_directories(folder + "/state/fleet");
  {
    auto queue = fleet::FleetQueue::Open(folder + "/state/fleet/queue.sqlite", 64'000'000);
    if (!queue || !queue.value().Append(messages, "")) return 1;
    std::ofstream lines(folder + "/lines");
    for (const fleet::QueuedMessage& one : queue.value().Next(0, messages.size()).value()) {
      const std::string text = fleet::MessageText(queue.value().stream(), one);
      bytes += text.size();
      lines << text << "\n";
    }
  }
  Child peer(Start(
      {"mosquitto_pub", "-p", std::to_string(port), "-q", "1", "-l", "-t", "peer/bench/NDATA/cell"},
      log, folder + "/lines"));
  if (!Within(60, [&] { return counter.count == messages.size(); })) return 1;
  const double peer_s = counter.newest_s - counter.first_s;
  peer.Wait();

  auto publisher = view_link::ViewPublisher::Open(view_link::ViewSocketOf(folder + "/state"));
  if (!publisher) return 1;
  std::ifstream shipped(argv[2]);
  std::ofstream(folder + "/plumbline.toml")
      << "state_directory = \"" << folder << "/state\"\n"
      << shipped.rdbuf() << "\n[mqtt]\nhost = \"127.0.0.1\"\ngroup = \"bench\"\nport = " << port
      << "\n";
  for (const char* name : {"cells", "profiles"}) {
    std::filesystem::copy(std::filesystem::path(argv[2]).parent_path() / name, folder + "/" + name,
                          std::filesystem::copy_options::recursive);
  }
  counter.count = 0;
  Child fleet(Start({argv[1], folder + "/plumbline.toml"}, log));
  // The birth message comes first; the live feed follows after all queued messages.
  if (!Within(60, [&] { return counter.count >= 1 + messages.size(); })) return 1;
  const double ours_s = counter.newest_s - counter.first_s;

  std::atomic<bool> stop{false};
  std::thread feed([&] {
    while (!stop) {
      if (publisher.value()->PollViewers()) publisher.value()->Send(StateAt(0));
      SleepSeconds(kFeedPeriod_s);
    }
  });
  SleepSeconds(3);
  const double before_s = CpuSeconds(fleet.pid());
  SleepSeconds(kIdle_s);
  const double cpu_share = (CpuSeconds(fleet.pid()) - before_s) / kIdle_s,
               memory_MB = ResidentMB(fleet.pid());
  stop = true;
  feed.join();
  fleet.End();
  mosquitto_disconnect(client);
  mosquitto_loop_stop(client, true);
  mosquitto_destroy(client);

  fmt::print("| what | ours | peer | ratio |\n|---|---|---|---|\n");
  fmt::print(
      "| {} messages of one hour ({:.2f} MB) forwarded, each deleted from disk when acknowledged | "
      "{:.0f} ms | {:.0f} ms (mosquitto_pub -l -q 1 from a file, nothing stored) | {:.2f} |\n",
      messages.size(), 1e-6 * static_cast<double>(bytes), 1e3 * ours_s, 1e3 * peer_s,
      ours_s / peer_s);
  fmt::print("| capacity of a 64 MB queue at that rate | {:.1f} days | | |\n",
             64e6 /
                 (static_cast<double>(bytes) +
                  fleet::FleetQueue::kRowBytes * static_cast<double>(messages.size())) /
                 24);
  fmt::print("| CPU time when idle, checking 5 states a second | {:.2f} % of a core | | |\n",
             100 * cpu_share);
  fmt::print("| resident memory | {:.1f} MB | | |\n", memory_MB);
  return 0;
}
