#include "drivers/modbus/tcp_server.h"

#include <fcntl.h>
#include <modbus/modbus.h>
#include <sys/resource.h>

#include <atomic>
#include <catch2/catch.hpp>
#include <cerrno>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "tests/drivers/modbus/raw_client.h"
#include "tests/drivers/modbus/test_image.h"

namespace plumbline::tcp_server_test {

using namespace plumbline::modbus;

namespace {

using Bytes = RawClient::Bytes;
using Kind = TcpServerEvent::Kind;

struct Context {
  void operator()(modbus_t* context) const {
    modbus_close(context);
    modbus_free(context);
  }
};
using LibmodbusClient = std::unique_ptr<modbus_t, Context>;

struct Served {
  TestDevice device;
  std::mutex mutex;
  std::vector<Kind> events;
  std::unique_ptr<TcpServer> server;

  explicit Served(TcpServerOptions options = {}, InheritedSockets inherited = {}) {
    options.port = 0;
    options.on_event = [this](const TcpServerEvent& event) {
      const std::lock_guard lock(mutex);
      events.push_back(event.kind);
    };
    auto started = TcpServer::Start(options, device.handler, std::move(inherited));
    if (!started) FAIL(started.error());
    server = std::move(started).value();
  }
  int port() const { return server->port(); }
  bool Saw(Kind kind) {
    const std::lock_guard lock(mutex);
    return std::find(events.begin(), events.end(), kind) != events.end();
  }
  LibmodbusClient Connect() const {
    LibmodbusClient client(modbus_new_tcp("127.0.0.1", port()));
    REQUIRE(modbus_connect(client.get()) == 0);
    return client;
  }
};

Bytes Frame(std::uint8_t transaction, const Bytes& pdu, std::uint8_t unit = 1) {
  Bytes frame = {0, transaction, 0, 0, 0, static_cast<std::uint8_t>(pdu.size() + 1), unit};
  frame.insert(frame.end(), pdu.begin(), pdu.end());
  return frame;
}

const Bytes kRead = {3, 0, 2, 0, 1};
const Bytes kReadReply = {3, 2, 0, 2};

/// True if a new client is served.
bool Answers(int port, const std::string& from = "127.0.0.1") {
  const RawClient client(port, from);
  return client.Exchange(Frame(1, kRead), 11) == Frame(1, kReadReply);
}

}  // namespace

TEST_CASE("TCP server: libmodbus as client, all its functions", "[modbus][tcp]") {
  Served served;
  const auto client = served.Connect();
  modbus_t* c = client.get();
  std::uint16_t words[125];
  std::uint8_t bits[16];
  REQUIRE(modbus_read_registers(c, 100, 125, words) == 125);
  CHECK(words[0] == 100);
  CHECK(words[124] == 224);
  REQUIRE(modbus_read_input_registers(c, 0, 20, words) == 20);
  CHECK(words[19] == 19);
  REQUIRE(modbus_read_bits(c, 0, 16, bits) == 16);
  CHECK(bits[3] == 1);
  CHECK(bits[4] == 0);
  REQUIRE(modbus_read_input_bits(c, 3, 1, bits) == 1);
  CHECK(bits[0] == 1);
  CHECK(modbus_write_bit(c, 20, 1) == 1);
  const std::uint8_t coils[] = {1, 0, 1};
  CHECK(modbus_write_bits(c, 21, 3, coils) == 3);
  REQUIRE(modbus_read_bits(c, 20, 4, bits) == 4);
  CHECK(std::vector<int>(bits, bits + 4) == std::vector<int>{1, 1, 0, 1});
  CHECK(modbus_write_register(c, 1000, 7) == 1);
  const std::uint16_t values[] = {8, 9};
  CHECK(modbus_write_registers(c, 1001, 2, values) == 2);
  CHECK(modbus_mask_write_register(c, 1000, 0xFFF0, 0x0005) == 1);
  REQUIRE(modbus_write_and_read_registers(c, 1003, 2, values, 1000, 5, words) == 5);
  CHECK(std::vector<int>(words, words + 5) == std::vector<int>{5, 8, 9, 8, 9});
  CHECK(served.device.handler.Commands()->registers.values[2] == 9);
  CHECK(served.device.handler.Commands()->coils.values[3] == 1);
}

TEST_CASE("TCP server: exceptions as libmodbus sees them", "[modbus][tcp]") {
  Served served;
  const auto client = served.Connect();
  std::uint16_t word = 0;
  CHECK(modbus_read_registers(client.get(), 50, 1, &word) == -1);
  CHECK(errno == EMBXILADD);
  CHECK(modbus_write_register(client.get(), 2, 1) == -1);
  CHECK(errno == EMBXILADD);
  CHECK(modbus_write_register(client.get(), 1000, 1) == 1);
}

TEST_CASE("TCP server: requests are answered from the newest image", "[modbus][tcp]") {
  Served served;
  const auto client = served.Connect();
  std::uint16_t word = 0;
  for (const std::uint16_t offset : std::initializer_list<std::uint16_t>{0, 500, 9000}) {
    served.device.Publish(offset);
    REQUIRE(modbus_read_registers(client.get(), 3, 1, &word) == 1);
    CHECK(word == 3 + offset);
  }
}

TEST_CASE("TCP server: unit ids", "[modbus][tcp]") {
  Served served({.unit_id = 17});
  const RawClient client(served.port());
  for (const std::uint8_t unit : Bytes{0, 1, 17, 255}) {
    CAPTURE(static_cast<int>(unit));
    CHECK(client.Exchange(Frame(1, kRead, unit), 11) == Frame(1, kReadReply, unit));
  }
  for (const std::uint8_t unit : Bytes{2, 16, 247, 254}) {
    CAPTURE(static_cast<int>(unit));
    CHECK(client.Exchange(Frame(1, kRead, unit), 9) == Frame(1, {0x83, 0x0B}, unit));
  }
  // Reported once for each client and id, also after the client has reconnected.
  const RawClient again(served.port());
  CHECK(again.Exchange(Frame(1, kRead, 247), 9) == Frame(1, {0x83, 0x0B}, 247));
  CHECK(again.Exchange(Frame(1, kRead, 1), 11) == Frame(1, kReadReply, 1));
  const std::lock_guard lock(served.mutex);
  CHECK(std::count(served.events.begin(), served.events.end(), Kind::kOtherUnit) == 4);
}

TEST_CASE("TCP server: pipelined frames are answered in order, including invalid requests",
          "[modbus][tcp]") {
  Served served;
  const RawClient client(served.port());
  Bytes requests, answers;
  for (std::uint8_t i = 0; i < 200; ++i) {
    const bool known = i % 3 != 0;
    const Bytes request = Frame(i, known ? kRead : Bytes{0x55});
    const Bytes answer = Frame(i, known ? kReadReply : Bytes{0xD5, 1});
    requests.insert(requests.end(), request.begin(), request.end());
    answers.insert(answers.end(), answer.begin(), answer.end());
  }
  CHECK(client.Exchange(requests, answers.size()) == answers);
}

TEST_CASE("TCP server: a frame in pieces", "[modbus][tcp]") {
  Served served;
  const RawClient client(served.port());
  const Bytes frame = Frame(9, kRead);
  for (std::size_t cut = 1; cut < frame.size(); ++cut) {
    client.Send({frame.begin(), frame.begin() + static_cast<std::ptrdiff_t>(cut)});
    std::this_thread::yield();
    client.Send({frame.begin() + static_cast<std::ptrdiff_t>(cut), frame.end()});
    CHECK(client.Receive(11) == Frame(9, kReadReply));
  }
  for (const std::uint8_t byte : frame) client.Send({byte});
  CHECK(client.Receive(11) == Frame(9, kReadReply));
}

TEST_CASE("TCP server: connections with broken framing are closed, others served",
          "[modbus][tcp]") {
  struct Case {
    const char* what;
    Bytes bytes;
  };
  const Case cases[] = {
      {"protocol id 1", {0, 1, 0, 1, 0, 6, 1, 3, 0, 0, 0, 1}},
      {"length 0", {0, 1, 0, 0, 0, 0, 1, 3}},
      {"length 1", {0, 1, 0, 0, 0, 1, 1, 3}},
      {"length 255", {0, 1, 0, 0, 0, 255, 1, 3}},
      {"length 65535", {0, 1, 0, 0, 255, 255, 1, 3}},
      {"HTTP", {'G', 'E', 'T', ' ', '/', '\r', '\n'}},
  };
  for (const Case& c : cases) {
    INFO(c.what);
    Served served;
    const RawClient good(served.port()), bad(served.port());
    bad.Send(c.bytes);
    CHECK(bad.WaitUntilClosed());
    CHECK(served.Saw(Kind::kBrokenFrame));
    CHECK(good.Exchange(Frame(1, kRead), 11) == Frame(1, kReadReply));
  }
}

TEST_CASE("TCP server: good frames before a broken one are answered", "[modbus][tcp]") {
  Served served;
  const RawClient client(served.port());
  Bytes bytes = Frame(5, kRead);
  bytes.insert(bytes.end(), {0, 1, 0, 1});
  CHECK(client.Exchange(bytes, 100) == Frame(5, kReadReply));
}

TEST_CASE("TCP server: an incomplete and a dripping frame are closed, others served",
          "[modbus][tcp]") {
  Served served;
  const RawClient good(served.port()), half(served.port()), dripping(served.port());
  half.Send({0, 1, 0, 0, 0});
  std::atomic<bool> closed{false};
  std::thread drip([&] {
    const Bytes frame = Frame(1, Bytes(200, 3));
    for (std::size_t i = 0; i < frame.size() && dripping.Send({frame[i]}); ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
    closed = true;
  });
  int polls = 0;
  while (!closed) {
    REQUIRE(good.Exchange(Frame(1, kRead), 11) == Frame(1, kReadReply));
    ++polls;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  drip.join();
  CHECK(polls > 0);
  CHECK(half.WaitUntilClosed());
  CHECK(dripping.WaitUntilClosed());
  CHECK(served.server->counters().timeouts == 2);
  CHECK(served.Saw(Kind::kFrameTimeout));
  CHECK(good.Exchange(Frame(1, kRead), 11) == Frame(1, kReadReply));
}

TEST_CASE("TCP server: a client that never reads is dropped, others served", "[modbus][tcp]") {
  Served served;
  const RawClient good(served.port()), deaf(served.port(), "127.0.0.1", 4096);
  ::fcntl(deaf.fd(), F_SETFL, O_NONBLOCK);
  Bytes flood;
  for (int i = 0; i < 100; ++i) {
    const Bytes frame = Frame(1, {3, 0, 100, 0, 125});
    flood.insert(flood.end(), frame.begin(), frame.end());
  }
  while (served.server->counters().not_reading == 0) {
    deaf.Send(flood);
    REQUIRE(good.Exchange(Frame(1, kRead), 11) == Frame(1, kReadReply));
  }
  // The counter is incremented before the event is reported and the connection closed.
  const auto soon = [](const auto& holds) {
    for (int wait = 0; wait < 500 && !holds(); ++wait) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return holds();
  };
  CHECK(soon([&] { return served.Saw(Kind::kNotReading); }));
  CHECK(soon([&] { return served.server->counters().clients == 1; }));
}

TEST_CASE("TCP server: a slow reader gets every response completely", "[modbus][tcp]") {
  Served served;
  const RawClient client(served.port(), "127.0.0.1", 4096);
  constexpr int kRequests = 2000;
  std::thread sender([&] {
    for (int i = 0; i < kRequests; ++i) client.Send(Frame(1, {3, 0, 100, 0, 100}));
  });
  Bytes expected = {3, 200};
  for (std::uint8_t i = 100; i < 200; ++i) expected.insert(expected.end(), {0, i});
  int whole = 0;
  for (int i = 0; i < kRequests; ++i) {
    if (client.Receive(209) == Frame(1, expected)) ++whole;
  }
  sender.join();
  CHECK(whole == kRequests);
}

TEST_CASE("TCP server: responses reach a client that has shut down its sending side",
          "[modbus][tcp]") {
  Served served;
  const RawClient client(served.port());
  client.Send(Frame(1, kRead));
  ::shutdown(client.fd(), SHUT_WR);
  CHECK(client.Receive(11) == Frame(1, kReadReply));
  CHECK(client.WaitUntilClosed());
}

TEST_CASE("TCP server: abandoned connections make room for others", "[modbus][tcp]") {
  Served served({.max_clients = 4});
  const RawClient good(served.port());
  REQUIRE(good.Exchange(Frame(1, kRead), 11) == Frame(1, kReadReply));
  std::vector<RawClient> abandoned;
  for (int i = 0; i < 50; ++i) {
    abandoned.emplace_back(served.port());
    const RawClient closed_at_once(served.port());
    REQUIRE(good.Exchange(Frame(1, kRead), 11) == Frame(1, kReadReply));
  }
  CHECK(Answers(served.port()));
  CHECK(served.server->counters().evicted > 0);
  CHECK(served.server->counters().clients <= 4);
}

TEST_CASE("TCP server: a connection whose descriptor is kept open is served by the next server",
          "[modbus][tcp]") {
  TcpServerOptions options{.offers_connections = true, .max_clients = 8};
  auto served = std::make_unique<Served>(options);
  const RawClient plc(served->port()), silent(served->port()), gone(served->port());
  REQUIRE(plc.Exchange(Frame(1, kRead), 11) == Frame(1, kReadReply));
  const auto take = [](TcpServer& server, std::size_t count) {
    std::vector<os::Descriptor> all;
    for (int wait = 0; wait < 500 && all.size() < count; ++wait) {
      for (os::Descriptor& one : server.TakeOffered()) all.push_back(std::move(one));
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return all;
  };
  std::vector<os::Descriptor> kept = take(*served->server, 1);
  REQUIRE(kept.size() == 1);                        // a client without a request is not offered
  for (const std::uint8_t number : Bytes{2, 22}) {  // the second after the first server has ended
    REQUIRE(plc.Exchange(Frame(number, kRead), 11) == Frame(number, kReadReply));
  }
  CHECK(served->server->TakeOffered().empty());  // none is offered twice
  REQUIRE(gone.Exchange(Frame(3, kRead), 11) == Frame(3, kReadReply));
  for (os::Descriptor& one : take(*served->server, 1)) kept.push_back(std::move(one));
  REQUIRE(kept.size() == 2);

  served.reset();
  CHECK(silent.WaitUntilClosed());
  plc.Send(Frame(4, kRead));  // while no server runs
  ::shutdown(gone.fd(), SHUT_RDWR);

  Served next(options, {.connections = std::move(kept)});
  CHECK(plc.Receive(11) == Frame(4, kReadReply));
  CHECK(plc.Exchange(Frame(5, kRead), 11) == Frame(5, kReadReply));
  for (int wait = 0; wait < 500 && next.server->counters().clients != 1; ++wait) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  CHECK(next.server->counters().clients == 1);
  const std::vector<os::Descriptor> again = take(*next.server, 1);
  REQUIRE(again.size() == 1);
  plc.Send({0, 1, 0, 1, 0, 0, 0});  // not Modbus: shut down for the holder, too
  CHECK(plc.WaitUntilClosed());
}

TEST_CASE("TCP server: an inherited connection whose address is no longer allowed is closed",
          "[modbus][tcp]") {
  auto served = std::make_unique<Served>(TcpServerOptions{.offers_connections = true});
  const RawClient plc(served->port(), "127.0.0.2");
  REQUIRE(plc.Exchange(Frame(1, kRead), 11) == Frame(1, kReadReply));
  std::vector<os::Descriptor> kept;
  for (int wait = 0; wait < 500 && kept.empty(); ++wait) {
    kept = served->server->TakeOffered();
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  REQUIRE(kept.size() == 1);
  const os::Descriptor keeper(::dup(kept[0].get()));
  served.reset();
  Served next({.allow = {"127.0.0.1"}}, {.connections = std::move(kept)});
  CHECK(plc.WaitUntilClosed());
  CHECK(next.Saw(Kind::kNotAllowed));
}

TEST_CASE("TCP server: eviction when all slots are taken", "[modbus][tcp]") {
  Served served({.max_clients = 3});
  const RawClient first(served.port()), second(served.port());
  REQUIRE(first.Exchange(Frame(1, kRead), 11) == Frame(1, kReadReply));
  REQUIRE(second.Exchange(Frame(1, kRead), 11) == Frame(1, kReadReply));
  const RawClient silent(served.port());
  while (served.server->counters().accepted < 3) std::this_thread::yield();
  REQUIRE(first.Exchange(Frame(1, kRead), 11) == Frame(1, kReadReply));

  const RawClient third(served.port());
  REQUIRE(third.Exchange(Frame(1, kRead), 11) == Frame(1, kReadReply));
  CHECK(silent.WaitUntilClosed());  // it never sent a request
  const RawClient fourth(served.port());
  REQUIRE(fourth.Exchange(Frame(1, kRead), 11) == Frame(1, kReadReply));
  CHECK(second.WaitUntilClosed());  // idle for longer than the first
  CHECK(first.Exchange(Frame(1, kRead), 11) == Frame(1, kReadReply));
  CHECK(third.Exchange(Frame(1, kRead), 11) == Frame(1, kReadReply));
  CHECK(served.Saw(Kind::kEvicted));
  CHECK(served.server->counters().evicted == 2);
}

TEST_CASE(
    "TCP server: addresses not in the allow list are refused, each allowed one has a reserved slot",
    "[modbus][tcp]") {
  Served served({.max_clients = 3, .allow = {"127.0.0.1", "127.0.0.2", "::1"}});
  const RawClient stranger(served.port(), "127.0.0.9");
  CHECK(stranger.WaitUntilClosed());
  CHECK(served.Saw(Kind::kNotAllowed));
  CHECK(served.server->counters().accepted == 0);

  const RawClient quiet(served.port(), "127.0.0.2");
  REQUIRE(quiet.Exchange(Frame(1, kRead), 11) == Frame(1, kReadReply));
  for (int i = 0; i < 10; ++i) {
    const RawClient crowd(served.port()), more(served.port()), yet_more(served.port());
    CHECK(yet_more.Exchange(Frame(1, kRead), 11) == Frame(1, kReadReply));
  }
  CHECK(quiet.Exchange(Frame(1, kRead), 11) == Frame(1, kReadReply));
}

TEST_CASE("TCP server: without a free descriptor a new client is refused, later ones are not",
          "[modbus][tcp]") {
  Served served;
  const RawClient good(served.port());
  REQUIRE(good.Exchange(Frame(1, kRead), 11) == Frame(1, kReadReply));
  rlimit limit{};
  ::getrlimit(RLIMIT_NOFILE, &limit);
  // The new client's own descriptor is the last one available.
  const int newcomer = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  rlimit none_left = limit;
  none_left.rlim_cur = static_cast<rlim_t>(newcomer);
  std::vector<int> fillers;
  for (int fd = ::dup(newcomer); fd >= 0 && fd < newcomer; fd = ::dup(newcomer)) {
    fillers.push_back(fd);
  }
  ::setrlimit(RLIMIT_NOFILE, &none_left);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(served.port()));
  const int connected =
      ::connect(newcomer, reinterpret_cast<const sockaddr*>(&address), sizeof address);
  std::uint8_t byte = 0;
  const ssize_t received = ::recv(newcomer, &byte, 1, 0);
  const bool served_meanwhile = good.Exchange(Frame(1, kRead), 11) == Frame(1, kReadReply);
  ::setrlimit(RLIMIT_NOFILE, &limit);
  for (const int fd : fillers) ::close(fd);
  ::close(newcomer);
  CHECK(connected == 0);
  CHECK(received <= 0);
  CHECK(served_meanwhile);
  CHECK(served.Saw(Kind::kOutOfDescriptors));
  CHECK(Answers(served.port()));
}

TEST_CASE("TCP server: an open listening socket can be handed over", "[modbus][tcp]") {
  TestDevice device;
  auto listener = os::TcpListener::Open("::", 0);
  if (!listener) {
    WARN("skipped, no IPv6 here: " << listener.error());
    return;
  }
  const int port = listener->endpoint().port;
  const auto server = TcpServer::Start({.allow = {"127.0.0.1"}}, device.handler,
                                       {.listener = os::Descriptor(::dup(listener->fd()))});
  REQUIRE(server.ok());
  CHECK((*server)->port() == port);
  CHECK(Answers(port));
}

TEST_CASE("TCP server: each start-up fault has its message", "[modbus][tcp]") {
  TestDevice device;
  Served taken;
  struct Case {
    TcpServerOptions options;
    const char* message;
  };
  const Case cases[] = {
      {{.address = "localhost", .port = 0}, "localhost port 0: neither an IPv4 nor an IPv6"},
      {{.port = 70000}, "port 70000: the port is outside 0..65535"},
      {{.port = taken.port()}, "another program uses the port"},
      {{.address = "192.0.2.1", .port = 0}, "no interface of this machine has this address"},
      {{.port = 0, .max_clients = 0}, "max_clients is below 1"},
      {{.port = 0, .allow = {"10.0.0"}}, "allow list: \"10.0.0\" is neither"},
  };
  for (const Case& c : cases) {
    const auto server = TcpServer::Start(c.options, device.handler);
    REQUIRE_FALSE(server.ok());
    CHECK_THAT(server.error(), Catch::Contains(c.message));
  }
}

TEST_CASE("TCP server: every block read is from one image", "[modbus][tcp]") {
  Served served;
  std::atomic<bool> stop{false};
  std::thread writer([&] {
    for (std::uint16_t offset = 0; !stop; ++offset) served.device.Publish(offset);
  });
  const auto client = served.Connect();
  int torn = 0;
  for (int i = 0; i < 5000; ++i) {
    std::uint16_t words[100];
    REQUIRE(modbus_read_registers(client.get(), 100, 100, words) == 100);
    for (int k = 0; k < 100; ++k) {
      if (words[k] != static_cast<std::uint16_t>(words[0] + k)) ++torn;
    }
  }
  stop = true;
  writer.join();
  CHECK(torn == 0);
}

}  // namespace plumbline::tcp_server_test
