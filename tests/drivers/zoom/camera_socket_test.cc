// A camera whose name has two addresses, the first of which it does not use.
#include "drivers/zoom/camera_socket.h"

#include <netdb.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>

#include <array>
#include <catch2/catch.hpp>
#include <cerrno>
#include <cstring>

#include "drivers/clock.h"
#include "drivers/zoom/visca_link.h"

extern "C" {
int __real_getaddrinfo(const char*, const char*, const addrinfo*, addrinfo**);

int __wrap_getaddrinfo(const char* host, const char* port, const addrinfo* hints,
                       addrinfo** found) {
  if (std::strcmp(host, "two.test") != 0 || (hints->ai_flags & AI_NUMERICHOST) != 0) {
    return __real_getaddrinfo(host, port, hints, found);
  }
  const int error = __real_getaddrinfo("127.0.0.2", port, hints, found);
  return error != 0 ? error : __real_getaddrinfo("127.0.0.1", port, hints, &(*found)->ai_next);
}
}

namespace plumbline::zoom {
namespace {

using visca::Transport;

/// Bound to a free port of 127.0.0.1.
struct Socket {
  os::Descriptor fd;
  int port = 0;

  explicit Socket(int type) : fd(socket(AF_INET, type | SOCK_CLOEXEC, 0)) {
    sockaddr_in own{};
    own.sin_family = AF_INET;
    own.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof own;
    REQUIRE(bind(fd.get(), reinterpret_cast<const sockaddr*>(&own), size) == 0);
    if (type == SOCK_STREAM) REQUIRE(listen(fd.get(), 1) == 0);
    REQUIRE(getsockname(fd.get(), reinterpret_cast<sockaddr*>(&own), &size) == 0);
    port = ntohs(own.sin_port);
  }
  bool Readable() const {
    pollfd wait{.fd = fd.get(), .events = POLLIN, .revents = 0};
    return poll(&wait, 1, 1000) == 1;
  }
};

constexpr double kLong_s = 5;

}  // namespace

TEST_CASE("every address of a name is tried, over TCP and over UDP") {
  for (const auto& [type, transport] :
       {std::pair{SOCK_STREAM, Transport::kTcp}, std::pair{SOCK_DGRAM, Transport::kUdp}}) {
    const Socket camera(type);
    const auto link = MakeViscaLink({transport, "two.test", camera.port}, 9600, MonotonicSeconds);
    const bool open = link->Open(MonotonicSeconds() + kLong_s);
    INFO(link->problem());
    CHECK(open);
    CHECK(camera.Readable());
  }
}

TEST_CASE("nobody listens at any address: refused, and the next attempt starts again") {
  int port = 0;
  {
    const Socket closed(SOCK_STREAM);
    port = closed.port;
  }
  const auto link = MakeViscaLink({Transport::kTcp, "two.test", port}, 9600, MonotonicSeconds);
  for (int attempt = 0; attempt < 3; ++attempt) {
    CHECK_FALSE(link->Open(MonotonicSeconds() + kLong_s));
    CHECK_THAT(link->problem(), Catch::Contains("refuses TCP port"));
  }
}

TEST_CASE("the remedy for a blocked network names the address, which systemd takes, not the name") {
  CameraHost host({Transport::kUdp, "two.test", 52381});
  os::Descriptor fd;
  std::string problem;
  REQUIRE(host.Connect(kLong_s, fd, problem));
  CHECK_THAT(host.ErrorText(EPERM), Catch::Contains("IPAddressAllow=127.0.0.2;"));
  CHECK(host.TryNext());
  REQUIRE(host.Connect(kLong_s, fd, problem));
  CHECK_THAT(host.ErrorText(EACCES), Catch::Contains("IPAddressAllow=127.0.0.1;"));
  CHECK_FALSE(host.TryNext());
  CameraHost local({Transport::kUdp, "::1", 52381});
  if (local.Connect(0, fd, problem)) {
    CHECK_THAT(local.ErrorText(EPERM), Catch::Contains("IPAddressAllow=::1;"));
  }
}

}  // namespace plumbline::zoom
