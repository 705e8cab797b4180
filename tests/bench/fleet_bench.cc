// Benchmark of the publisher: forwarding an hour of queued messages to Mosquitto, and the idle
// load. fleet_bench PLUMBLINE_FLEET CONFIG
#include <arpa/inet.h>
#include <fmt/format.h>
#include <mosquitto.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>

#include "app/cell/view_link/view_publisher.h"
#include "app/plant/publish/change_detector.h"
#include "app/plant/publish/queue.h"
#include "drivers/clock.h"
#include "firmware-like/snapshot.h"
#include "tests/bench/rows.h"
#include "tests/bench/started_program.h"

using namespace plumbline;

namespace {

constexpr double kHour_s = 3600, kFeedPeriod_s = 0.2;
constexpr int kPoints = 10, kProbesPerHour = 60;

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
cell::ViewState StateAt(double time_s) {
  cell::ViewState state;
  state.utc_s = 1.8e9 + time_s;
  state.model_version = 3;
  state.status = status::kReady | status::kRobotLink;
  state.q = model::JointVector::Constant(6, 0.3);
  state.payload_kg = 60;
  state.temp_C = 24.5;
  const int minute = static_cast<int>(time_s / 60);
  if (minute % 2 == 1 && time_s - 60 * minute < 20) state.alarms = alarm::kRobotStale;
  for (int k = 0; k < kPoints; ++k) {
    cell::ViewPoint point;
    point.id = k + 1;
    point.valid = true;
    point.code = correction::CorrectionCode::kOk;
    if (k < 2) point.translation_B.x() = 1e-3 * minute;
    state.points.push_back(point);
  }
  return state;
}

std::vector<plant::Message> MessagesOfOneHour() {
  config::MqttConfig config;
  plant::FleetCell cell{"bench", "cell", "bench", std::vector<model::Joint>(6), {}};
  plant::ChangeDetector changes(config, cell, "");
  std::vector<plant::Message> messages;
  int probes = 0;
  for (double time_s = 0; time_s < kHour_s; time_s += kFeedPeriod_s) {
    for (plant::Message& message : changes.Update(StateAt(time_s), time_s)) {
      messages.push_back(std::move(message));
    }
    if (time_s < kHour_s * probes / kProbesPerHour) continue;
    plant::ProbeRow probe;
    probe.id = ++probes;
    probe.measured_W = probe.predicted_W = Vec3::Zero();
    probe.t_s = time_s;
    probe.q = model::JointVector::Constant(6, 0.3);
    messages.push_back({plant::MessageKind::kProbe, 1, plant::ProbeBody(probe, cell.joints)});
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
  if (argc < 3) return 2;
  const bench::Effort effort = bench::EffortFrom(argc, argv);
  const double idle_s = bench::Choose(effort, 1.0, 10.0, 30.0);
  if (access("/usr/sbin/mosquitto", X_OK) != 0) {
    bench::ReportSkipped("MQTT publisher", "mosquitto is not installed (apt install mosquitto)");
    return 0;
  }
  const bench::WorkFolder own;
  const std::string folder = own.path(), log = folder + "/log";
  const int port = FreePort();
  std::ofstream(folder + "/mosquitto.conf")
      << "listener " << port << " 127.0.0.1\nallow_anonymous true\nmax_queued_messages 0\n";
  const os::ChildProcess broker =
      bench::StartProgram({"/usr/sbin/mosquitto", "-c", folder + "/mosquitto.conf"}, log);

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

  const std::vector<plant::Message> messages = MessagesOfOneHour();
  std::size_t bytes = 0;
  std::filesystem::create_directories(folder + "/state/fleet");
  {
    auto queue = plant::FleetQueue::Open(folder + "/state/fleet/queue.sqlite", 64'000'000);
    if (!queue || !queue.value().Append(messages, "")) return 1;
    std::ofstream lines(folder + "/lines");
    for (const plant::QueuedMessage& one : queue.value().Next(0, messages.size()).value()) {
      const std::string text = plant::MessageText(queue.value().stream(), one);
      bytes += text.size();
      lines << text << "\n";
    }
  }
  os::ChildProcess peer = bench::StartProgram(
      {"mosquitto_pub", "-p", std::to_string(port), "-q", "1", "-l", "-t", "peer/bench/NDATA/cell"},
      log, {.input = folder + "/lines"});
  if (!Within(60, [&] { return counter.count == messages.size(); })) return 1;
  const double peer_s = counter.newest_s - counter.first_s;
  peer.End(10);

  auto publisher = cell::ViewPublisher::Open(cell::ViewSocketOf(folder + "/state"));
  if (!publisher) return 1;
  std::string config = test::FileText(argv[2]);
  constexpr std::string_view kHeader = "\n[mqtt]";  // which the supplied file has, without keys
  config.insert(config.find('\n', config.find(kHeader) + 1),
                fmt::format("\nhost = \"127.0.0.1\"\ngroup = \"bench\"\nport = {}", port));
  std::ofstream(folder + "/plumbline.toml") << "state_directory = \"" << folder << "/state\"\n"
                                            << config;
  for (const char* name : {"cells", "profiles"}) {
    std::filesystem::copy(std::filesystem::path(argv[2]).parent_path() / name, folder + "/" + name,
                          std::filesystem::copy_options::recursive);
  }
  counter.count = 0;
  os::ChildProcess fleet = bench::StartProgram({argv[1], folder + "/plumbline.toml"}, log);
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
  SleepSeconds(bench::Choose(effort, 0.5, 3.0, 3.0));
  const double before_s = CpuSeconds(fleet.pid());
  SleepSeconds(idle_s);
  const double cpu_share = (CpuSeconds(fleet.pid()) - before_s) / idle_s,
               memory_MB = ResidentMB(fleet.pid());
  stop = true;
  feed.join();
  fleet.End(10, SIGTERM);
  mosquitto_disconnect(client);
  mosquitto_loop_stop(client, true);
  mosquitto_destroy(client);

  bench::Report(
      {.what = fmt::format("{} messages of one hour forwarded from the disk", messages.size()),
       .ours = 1e3 * ours_s,
       .unit = "ms",
       .peer = "mosquitto_pub from a file",
       .peers = 1e3 * peer_s});
  bench::Report({.what = "capacity of a 64 MB queue",
                 .ours = 64e6 /
                         (static_cast<double>(bytes) +
                          plant::FleetQueue::kRowBytes * static_cast<double>(messages.size())) /
                         24,
                 .unit = "days",
                 .timed = false});
  bench::Report({.what = "CPU time of plumbline-fleet, checking 5 states a second",
                 .ours = 100 * cpu_share,
                 .unit = "% of a core"});
  bench::Report({.what = "resident memory of plumbline-fleet",
                 .ours = memory_MB,
                 .unit = "MB",
                 .timed = false});
  return 0;
}
