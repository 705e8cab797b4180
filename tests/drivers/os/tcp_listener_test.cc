// Listening sockets, tested with real local connections.
#include "drivers/os/tcp_listener.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <poll.h>

#include <catch2/catch.hpp>
#include <cerrno>

namespace plumbline::tcp_listener_test {

using namespace plumbline::os;
using Catch::Contains;

namespace {

TcpListener Open(const std::string& address = "127.0.0.1", int port = 0) {
  auto listener = TcpListener::Open(address, port);
  if (!listener) FAIL(listener.error());
  return std::move(listener).value();
}

/// A client by IPv4.
Descriptor ConnectTo(int port) {
  Descriptor client(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_port = htons(static_cast<std::uint16_t>(port));
  at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  REQUIRE(connect(client.get(), reinterpret_cast<const sockaddr*>(&at), sizeof at) == 0);
  return client;
}

Descriptor AcceptWithin(const TcpListener& listener, int time_ms, sockaddr_storage& peer) {
  pollfd waiting{listener.fd(), POLLIN, 0};
  poll(&waiting, 1, time_ms);
  return listener.Accept(peer);
}

bool Blocks(int fd) {
  return (fcntl(fd, F_GETFL) & O_NONBLOCK) == 0;
}

}  // namespace

TEST_CASE("clients are accepted with their address; accepting never waits", "[os]") {
  const TcpListener listener = Open();
  CHECK(listener.endpoint().address == "127.0.0.1");
  REQUIRE(listener.endpoint().port > 0);
  sockaddr_storage peer{};
  errno = 0;
  CHECK_FALSE(listener.Accept(peer));
  CHECK(errno == EAGAIN);
  const Descriptor client = ConnectTo(listener.endpoint().port);
  const Descriptor accepted = AcceptWithin(listener, 5000, peer);
  REQUIRE(accepted);
  CHECK_FALSE(Blocks(accepted.get()));
  CHECK((fcntl(accepted.get(), F_GETFD) & FD_CLOEXEC) != 0);
  CHECK(EndpointOf(peer).address == "127.0.0.1");
  CHECK(EndpointOf(peer).port > 0);
}

TEST_CASE("a socket for every address accepts IPv4 clients, and reports them in dotted notation",
          "[os]") {
  auto opened = TcpListener::Open("::", 0);
  if (!opened) {
    WARN("skipped, no IPv6 here: " << opened.error());
    return;
  }
  const TcpListener& listener = opened.value();
  const Descriptor client = ConnectTo(listener.endpoint().port);
  sockaddr_storage peer{};
  CHECK(AcceptWithin(listener, 5000, peer));
  CHECK(EndpointOf(peer).address == "127.0.0.1");
}

TEST_CASE("an inherited socket serves clients that connected before", "[os]") {
  const TcpListener before = Open();
  const Descriptor client = ConnectTo(before.endpoint().port);
  Descriptor handed_over(fcntl(before.fd(), F_DUPFD_CLOEXEC, 0));
  fcntl(handed_over.get(), F_SETFL, fcntl(handed_over.get(), F_GETFL) & ~O_NONBLOCK);
  const TcpListener after(std::move(handed_over));
  CHECK_FALSE(Blocks(after.fd()));
  CHECK(after.endpoint().Text() == before.endpoint().Text());
  sockaddr_storage peer{};
  CHECK(AcceptWithin(after, 5000, peer));
}

TEST_CASE("an error says why the socket cannot listen, with a remedy", "[os]") {
  const TcpListener taken = Open();
  const auto why = [](const std::string& address, int port) {
    const auto listener = TcpListener::Open(address, port);
    return listener ? std::string() : listener.error();
  };
  CHECK_THAT(why("127.0.0.1", taken.endpoint().port), Contains("another program uses the port"));
  CHECK_THAT(why("192.0.2.1", 0), Contains("no interface of this machine has this address"));
  CHECK_THAT(why("localhost", 0), Contains("neither an IPv4 nor an IPv6 address"));
  CHECK_THAT(why("127.0.0.1", 65536), Contains("outside 0..65535"));
  CHECK_THAT(why("127.0.0.1", -1), Contains("outside 0..65535"));
}

TEST_CASE("an endpoint as text", "[os]") {
  CHECK(TcpEndpoint{"192.168.0.3", 502}.Text() == "192.168.0.3:502");
  CHECK(TcpEndpoint{"fe80::1", 502}.Text() == "[fe80::1]:502");
  CHECK(EndpointOf(sockaddr_storage{}).address.empty());
}

}  // namespace plumbline::tcp_listener_test
