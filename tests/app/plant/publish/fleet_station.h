// plumbline-fleet with a simulated daemon: a real view socket and a real journal.
#pragma once

#include <fmt/format.h>

#include <atomic>
#include <mutex>
#include <optional>
#include <thread>

#include "app/cell/journal/journal.h"
#include "app/cell/view_link/view_publisher.h"
#include "drivers/clock.h"
#include "tests/app/cell/daemon/demo_config.h"
#include "tests/app/plant/broker/broker_process.h"
#include "tests/firmware-like/test_cell.h"

namespace plumbline::test {

/// Publishes a state twenty times a second, as the daemon does.
class FeedProcess {
 public:
  FeedProcess(const std::string& state_directory, int points) {
    auto opened = cell::ViewPublisher::Open(cell::ViewSocketOf(state_directory));
    REQUIRE(opened);
    publisher_ = std::move(opened).value();
    state_.version = "0.1.0";
    state_.cell = "stand-in";
    state_.model_version = 1;
    state_.status = status::kReady | status::kRobotLink;
    for (int k = 0; k < points; ++k) {
      cell::ViewPoint point;
      point.id = k + 1;
      point.valid = true;
      point.code = correction::CorrectionCode::kOk;
      state_.points.push_back(point);
    }
    thread_ = std::thread([this] {
      while (!stop_) {
        Send();
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
      }
    });
  }
  ~FeedProcess() {
    stop_ = true;
    thread_.join();
  }
  template <typename Change>
  void Set(Change change) {
    const std::lock_guard lock(mutex_);
    change(state_);
    ++state_.points_number;
  }

 private:
  void Send() {
    const std::lock_guard lock(mutex_);
    state_.now_s = MonotonicSeconds();
    state_.utc_s = static_cast<double>(std::chrono::duration_cast<std::chrono::milliseconds>(
                                           std::chrono::system_clock::now().time_since_epoch())
                                           .count()) *
                   1e-3;
    if (publisher_->PollViewers()) publisher_->Send(state_);
  }
  std::unique_ptr<cell::ViewPublisher> publisher_;
  std::mutex mutex_;
  cell::ViewState state_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

struct FleetStation {
  TemporaryFolder folder;
  std::string config = folder.path() + "/plumbline.toml";
  std::string state = folder.path() + "/state";
  std::optional<FeedProcess> feed;
  std::optional<cell::Journal> journal;
  const std::vector<model::Joint> joints = HeavyArm().robot.joints;
  pid_t pid = -1;

  explicit FleetStation(const std::string& mqtt, int points = 1) {
    std::filesystem::create_directories(state);
    auto opened = cell::Journal::Open(state + "/journal.sqlite");
    REQUIRE(opened);
    journal.emplace(std::move(opened).value());
    feed.emplace(state, points);
    Configure(mqtt);
    WriteModel(1, "");
  }
  ~FleetStation() { Kill(); }

  void Configure(const std::string& mqtt) const {
    std::ofstream(config) << WithLine(DemoConfig("127.0.0.1:1", "universal-robots-fine"), "",
                                      "state_directory", "\"" + state + "\"")
                          << "\n[mqtt]\nhost = \"127.0.0.1\"\nnode = \"cell-7\"\n"
                          << "state_s = 0.2\nchange_s = 0.2\n"
                          << mqtt;
  }
  /// A version in the daemon's model store.
  void WriteModel(int number, const std::string& head) const {
    std::filesystem::create_directories(state + "/models");
    std::ofstream(fmt::format("{}/models/{:04}.toml", state, number))
        << head << FileText("tests/virtual_cell/demo/cockpit-cell.toml");
  }
  void Start() {
    pid = fork();
    if (pid == 0) {
      const int log = open(LogFile().c_str(), O_WRONLY | O_CREAT | O_APPEND, 0644);
      dup2(log, STDERR_FILENO);
      dup2(log, STDOUT_FILENO);
      execl(PLUMBLINE_FLEET, PLUMBLINE_FLEET, config.c_str(), nullptr);
      _exit(127);
    }
  }
  void Signal(int number) const { kill(pid, number); }
  void Kill() {
    if (pid <= 0) return;
    kill(pid, SIGKILL);
    waitpid(pid, nullptr, 0);
    pid = -1;
  }
  int Wait() {
    int status = 0;
    if (!Soon([&] { return waitpid(pid, &status, WNOHANG) == pid; })) return -1;
    pid = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }
  std::string Log() const { return FileText(LogFile()); }
  bool Says(const std::string& text) const {
    return Soon([&] { return Log().find(text) != std::string::npos; });
  }
  void AddProbes(int count) {
    std::vector<cell::JournalRow> rows;
    for (int k = 0; k < count; ++k) {
      cell::JournalRow row;
      row.unix_ms = 1800000000000 + ++probes_;
      row.t_s = probes_;
      row.q = model::JointVector::Zero(static_cast<Eigen::Index>(joints.size()));
      row.predicted_W = Vec3(1, 2, 3);
      row.measured_W = Vec3(1, 2, 3 + 1e-4 * probes_);
      row.model_version = 1;
      rows.push_back(row);
    }
    REQUIRE(journal->Append(rows, joints));
  }

 private:
  std::string LogFile() const { return folder.path() + "/fleet.log"; }
  int probes_ = 0;
};

}  // namespace plumbline::test
