#include "tests/bench/modbus_servers.h"

#include <fcntl.h>
#include <modbus/modbus.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sched.h>
#include <sys/epoll.h>
#include <sys/prctl.h>
#include <sys/select.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <stdexcept>
#include <thread>
#include <vector>

#include "drivers/modbus/image_handler.h"
#include "drivers/modbus/tcp_server.h"

namespace plumbline::bench {
namespace {

using modbus::RegisterImage;

constexpr int kRegisters = 200;

/// CPU affinity of this process before any pinning.
const cpu_set_t& StartCpus() {
  static const cpu_set_t start = [] {
    cpu_set_t set;
    ::sched_getaffinity(0, sizeof set, &set);
    return set;
  }();
  return start;
}

void Report(int fd, int port) {
  if (::write(fd, &port, sizeof port) != sizeof port) ::_exit(1);
}

void WaitForParentExit(int life_fd) {
  char byte = 0;
  while (::read(life_fd, &byte, 1) > 0) {
  }
}

void Fill(RegisterImage& image, unsigned number) {
  for (unsigned k = 0; k < kRegisters; ++k) {
    image.registers[k] = static_cast<std::uint16_t>(number + k);
  }
}

void RunPlumbline(int report_fd, int life_fd, int publish_hz) {
  RegisterImage image;
  image.readable = std::make_shared<modbus::AddressRanges>(
      std::vector<modbus::AddressRanges::Range>{{0, kRegisters - 1}});
  image.registers.resize(kRegisters);
  Fill(image, 0);
  Latest<RegisterImage> images(1, image);
  modbus::CommandArea commands;
  commands.registers = {.first = 1000, .values = std::vector<std::uint16_t>(40)};
  modbus::ImageHandler handler(images, commands, {});
  auto server = modbus::TcpServer::Start({.address = "127.0.0.1", .port = 0}, handler);
  if (!server) {
    std::fprintf(stderr, "%s\n", server.error().c_str());
    ::_exit(1);
  }
  std::atomic<bool> stop{false};
  std::thread writer;
  if (publish_hz > 0) {
    writer = std::thread([&] {
      const auto period = std::chrono::nanoseconds(1'000'000'000 / publish_hz);
      auto next = std::chrono::steady_clock::now();
      for (unsigned number = 1; !stop; ++number) {
        Fill(images.Begin(), number);
        images.Publish();
        std::this_thread::sleep_until(next += period);
      }
    });
  }
  Report(report_fd, (*server)->port());
  WaitForParentExit(life_fd);
  stop = true;
  if (writer.joinable()) writer.join();
}

struct LibmodbusServer {
  modbus_t* context = modbus_new_tcp("127.0.0.1", 0);
  modbus_mapping_t* mapping = modbus_mapping_new(0, 0, kRegisters, kRegisters);
  int listener = -1;

  explicit LibmodbusServer(int report_fd) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    listener = ::socket(AF_INET, SOCK_STREAM, 0);
    socklen_t size = sizeof address;
    if (::bind(listener, reinterpret_cast<sockaddr*>(&address), size) != 0 ||
        ::listen(listener, 64) != 0) {
      ::_exit(1);
    }
    ::getsockname(listener, reinterpret_cast<sockaddr*>(&address), &size);
    Report(report_fd, ntohs(address.sin_port));
  }
  /// @return false if the client has disconnected
  bool ServeOne() const {
    std::uint8_t query[MODBUS_TCP_MAX_ADU_LENGTH];
    const int size = modbus_receive(context, query);
    if (size < 0) return false;
    if (size > 0) modbus_reply(context, query, size, mapping);
    return true;
  }
};

void RunLibmodbus(int report_fd) {
  LibmodbusServer server(report_fd);
  for (;;) {
    modbus_tcp_accept(server.context, &server.listener);
    while (server.ServeOne()) {
    }
    modbus_close(server.context);
  }
}

void RunLibmodbusSelect(int report_fd) {
  LibmodbusServer server(report_fd);
  fd_set watched;
  FD_ZERO(&watched);
  FD_SET(server.listener, &watched);
  int highest = server.listener;
  for (;;) {
    fd_set ready = watched;
    if (::select(highest + 1, &ready, nullptr, nullptr, nullptr) < 0) continue;
    for (int fd = 0; fd <= highest; ++fd) {
      if (!FD_ISSET(fd, &ready)) continue;
      if (fd == server.listener) {
        const int client = ::accept(server.listener, nullptr, nullptr);
        const int on = 1;
        ::setsockopt(client, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
        FD_SET(client, &watched);
        highest = std::max(highest, client);
        continue;
      }
      modbus_set_socket(server.context, fd);
      if (!server.ServeOne()) {
        ::close(fd);
        FD_CLR(fd, &watched);
      }
    }
  }
}

void RunEcho(int report_fd) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  const int listener = ::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK, 0);
  if (::bind(listener, reinterpret_cast<sockaddr*>(&address), size) != 0 ||
      ::listen(listener, SOMAXCONN) != 0) {
    ::_exit(1);
  }
  ::getsockname(listener, reinterpret_cast<sockaddr*>(&address), &size);
  const int epoll = ::epoll_create1(0);
  epoll_event event{.events = EPOLLIN, .data = {.fd = listener}};
  ::epoll_ctl(epoll, EPOLL_CTL_ADD, listener, &event);
  Report(report_fd, ntohs(address.sin_port));
  for (;;) {
    epoll_event events[64];
    const int count = ::epoll_wait(epoll, events, 64, -1);
    for (int i = 0; i < count; ++i) {
      const int fd = events[i].data.fd;
      if (fd == listener) {
        event.data.fd = ::accept4(listener, nullptr, nullptr, SOCK_NONBLOCK);
        const int on = 1;
        ::setsockopt(event.data.fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
        ::epoll_ctl(epoll, EPOLL_CTL_ADD, event.data.fd, &event);
        continue;
      }
      char bytes[260];
      const ssize_t got = ::recv(fd, bytes, sizeof bytes, 0);
      if (got <= 0 || ::send(fd, bytes, static_cast<std::size_t>(got), MSG_NOSIGNAL) < 0) {
        if (got < 0 && errno == EAGAIN) continue;
        if (got > 0 && errno == EAGAIN) continue;  // client does not read: drop the response
        ::close(fd);
      }
    }
  }
}

}  // namespace

ServerProcess::ServerProcess(ServerKind kind, int cpu, int publish_hz) {
  StartCpus();
  int report[2], life[2];
  if (::pipe2(report, O_CLOEXEC) != 0 || ::pipe2(life, O_CLOEXEC) != 0) {
    throw std::runtime_error("cannot create a pipe for a server process");
  }
  pid_ = ::fork();
  if (pid_ < 0) throw std::runtime_error("cannot fork a server process");
  if (pid_ == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    ::close(report[0]);
    ::close(life[1]);
    PinToCpu(cpu);
    switch (kind) {
      case ServerKind::kPlumbline:
        RunPlumbline(report[1], life[0], publish_hz);
        break;
      case ServerKind::kLibmodbus:
        RunLibmodbus(report[1]);
        break;
      case ServerKind::kLibmodbusSelect:
        RunLibmodbusSelect(report[1]);
        break;
      case ServerKind::kEcho:
        RunEcho(report[1]);
        break;
    }
    ::_exit(0);
  }
  ::close(report[1]);
  ::close(life[0]);
  life_fd_ = life[1];
  const bool started = ::read(report[0], &port_, sizeof port_) == sizeof port_;
  ::close(report[0]);
  if (!started) throw std::runtime_error("a server process did not start");
}

ServerProcess::~ServerProcess() {
  ::close(life_fd_);
  pollfd none{.fd = -1, .events = 0, .revents = 0};
  for (int tries = 0; tries < 50 && ::waitpid(pid_, nullptr, WNOHANG) == 0; ++tries) {
    if (tries == 10) ::kill(pid_, SIGKILL);  // the peers cannot be stopped otherwise
    ::poll(&none, 1, 20);
  }
}

void PinToCpu(int cpu) {
  cpu_set_t set = StartCpus();
  if (cpu >= 0) {
    CPU_ZERO(&set);
    CPU_SET(cpu, &set);
  }
  ::sched_setaffinity(0, sizeof set, &set);
}

int LastCpu() {
  int last = 0;
  for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
    if (CPU_ISSET(cpu, &StartCpus())) last = cpu;
  }
  return last;
}

}  // namespace plumbline::bench
