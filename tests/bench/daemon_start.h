// Fixture for daemon benchmarks: a fake robot, its profile, the memory of a process.
#pragma once

#include <fmt/core.h>
#include <modbus/modbus.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <fstream>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "tests/bench/started_program.h"

namespace plumbline::bench {

inline double Now_ms() {
  return 1e-6 * static_cast<double>(std::chrono::steady_clock::now().time_since_epoch() /
                                    std::chrono::nanoseconds(1));
}

inline double Quantile(std::vector<double> values, double fraction) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(fraction * static_cast<double>(values.size() - 1))];
}

/// Fake robot controller on libmodbus: joints as int32 microradians at 0, payload in grams at 12.
class BenchRobot {
 public:
  BenchRobot() : link_(modbus_new_tcp("127.0.0.1", 0)), map_(modbus_mapping_new(0, 0, 64, 0)) {
    listener_ = modbus_tcp_listen(link_, 1);
    sockaddr_in address{};
    socklen_t size = sizeof address;
    getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size);
    port_ = ntohs(address.sin_port);
    const int q_urad[] = {200000, -1400000, 1600000, -900000, -1300000, 300000};
    for (std::size_t k = 0; k < 6; ++k) {
      map_->tab_registers[2 * k] = static_cast<std::uint16_t>(q_urad[k] >> 16);
      map_->tab_registers[2 * k + 1] = static_cast<std::uint16_t>(q_urad[k] & 0xFFFF);
    }
    thread_ = std::thread([this] { Serve(); });
  }
  ~BenchRobot() {
    stop_ = true;
    shutdown(listener_, SHUT_RDWR);
    thread_.join();
    close(listener_);
    modbus_mapping_free(map_);
    modbus_free(link_);
  }
  int port() const { return port_; }
  std::uint16_t Register(int address) {
    const std::lock_guard lock(mutex_);
    return map_->tab_registers[address];
  }
  void SetPayload(std::uint16_t grams) {
    const std::lock_guard lock(mutex_);
    map_->tab_registers[12] = grams;
  }

 private:
  void Serve() {
    std::uint8_t query[MODBUS_TCP_MAX_ADU_LENGTH];
    while (!stop_ && modbus_tcp_accept(link_, &listener_) >= 0) {
      for (;;) {
        const int length = modbus_receive(link_, query);
        if (length < 0) break;
        const std::lock_guard lock(mutex_);
        modbus_reply(link_, query, length, map_);
      }
      modbus_close(link_);
    }
  }

  modbus_t* link_;
  modbus_mapping_t* map_;
  int listener_ = -1, port_ = 0;
  std::mutex mutex_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

inline constexpr const char* kProfile = R"(schema = 1
name = "bench"
source = "tests/bench/daemon_start.h"
port = 502
unit_id = 1
[[read]]
table = "holding"
first = 0
count = 13
[[joints]]
table = "holding"
address = [0, 2, 4, 6, 8, 10]
type = "int32"
unit = "urad"
[payload_mass]
table = "holding"
address = [12]
type = "uint16"
scale = 1.0
unit = "g"
)";

inline double ResidentMb(pid_t pid) {
  std::ifstream file(fmt::format("/proc/{}/status", pid));
  std::string word;
  while (file >> word) {
    if (word == "VmRSS:") {
      double kb = 0;
      file >> kb;
      return kb / 1024;
    }
  }
  return 0;
}

}  // namespace plumbline::bench
