#include "app/base/service/service_manager.h"

#include <fmt/format.h>
#include <systemd/sd-daemon.h>

#include <cstdlib>
#include <ctime>
#include <utility>

namespace plumbline::service {
namespace {

constexpr double kNotificationsPerPeriod = 4;
constexpr std::size_t kDescriptorsPerMessage = 64;  // the kernel allows 253 [unix(7)]

std::uint64_t MonotonicMicroseconds() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<std::uint64_t>(now.tv_sec) * 1'000'000U +
         static_cast<std::uint64_t>(now.tv_nsec) / 1000U;
}

}  // namespace

ServiceManager::ServiceManager() : available_(std::getenv("NOTIFY_SOCKET") != nullptr) {
  std::uint64_t period_us = 0;
  if (sd_watchdog_enabled(0, &period_us) > 0) {
    feed_period_s_ = 1e-6 * static_cast<double>(period_us) / kNotificationsPerPeriod;
  }
  unsetenv("WATCHDOG_USEC");
  unsetenv("WATCHDOG_PID");
  char** names = nullptr;
  const int count = sd_listen_fds_with_names(1, &names);
  for (int i = 0; i < count; ++i) {
    inherited_.push_back({names != nullptr && names[i] != nullptr ? names[i] : "",
                          os::Descriptor(SD_LISTEN_FDS_START + i)});
  }
  if (names == nullptr) return;
  for (char** name = names; *name != nullptr; ++name) std::free(*name);
  std::free(names);
}

void ServiceManager::NotifyWatchdog() const {
  sd_notify(0, "WATCHDOG=1");
}

void ServiceManager::RequestRestart() const {
  if (feed_period_s_) sd_notify(0, "WATCHDOG=trigger");
}

void ServiceManager::Ready(const std::string& status) const {
  sd_notify(0, fmt::format("READY=1\nSTATUS={}", status).c_str());
}

void ServiceManager::Status(const std::string& status) const {
  sd_notify(0, ("STATUS=" + status).c_str());
}

void ServiceManager::Reloading() const {
  sd_notify(0, fmt::format("RELOADING=1\nMONOTONIC_USEC={}", MonotonicMicroseconds()).c_str());
}

void ServiceManager::Stopping() const {
  sd_notify(0, "STOPPING=1");
}

os::Descriptor ServiceManager::TakeSocket(const std::string& name) {
  for (Inherited& socket : inherited_) {
    if (socket.name == name && socket.descriptor) return std::move(socket.descriptor);
  }
  return {};
}

std::vector<os::Descriptor> ServiceManager::TakeSockets(const std::string& name) {
  std::vector<os::Descriptor> taken;
  while (os::Descriptor socket = TakeSocket(name)) taken.push_back(std::move(socket));
  return taken;
}

void ServiceManager::StoreDescriptors(const std::string& name,
                                      std::vector<os::Descriptor> descriptors) const {
  const std::string message = fmt::format("FDSTORE=1\nFDNAME={}", name);
  for (std::size_t begin = 0; begin < descriptors.size(); begin += kDescriptorsPerMessage) {
    std::vector<int> some;
    for (std::size_t k = begin; k < descriptors.size() && some.size() < kDescriptorsPerMessage;
         ++k) {
      some.push_back(descriptors[k].get());
    }
    sd_pid_notify_with_fds(0, 0, message.c_str(), some.data(), static_cast<unsigned>(some.size()));
  }
}

}  // namespace plumbline::service
