// Access control and hostile or broken clients, over real sockets.
#include <fcntl.h>
#include <pthread.h>

#include "app/base/http/request_parts.h"
#include "tests/app/display/page/exposition.h"
#include "tests/app/display/page/page_scene.h"

namespace plumbline::page_access_test {

using namespace plumbline::display;
using namespace plumbline::test;
using Catch::Contains;

namespace {

constexpr const char* kToken = "a-long-word;=of+our-own";

}  // namespace

TEST_CASE("the token is accepted as header, cookie or parameter; without it only the login works") {
  PageScene scene;
  scene.Write("models/0007.html", "<p>seven</p>");
  scene.StartWithToken(kToken);
  scene.PublishStatus();
  for (const char* const path :
       {"/status.json", "/metrics", "/live.mjpg", "/picture.jpg", "/healthz", "/trend.json",
        "/reports.json", "/cameras.json", "/reports/0007.html", "/page.js", "/login", "/nothing"}) {
    INFO(path);
    const PageResponse answer = scene.Get(path);
    CHECK(answer.status == 401);
    CHECK(answer.Has("WWW-Authenticate: Bearer"));
    CHECK_THAT(answer.body, !Contains("demo") && !Contains("seven"));
  }
  const PageResponse login = scene.Get("/");
  CHECK(login.status == 401);
  CHECK_THAT(login.body, Contains("type=\"password\""));
  CHECK(scene.Get("/page.css").status == 200);
  CHECK(scene.Get("/login.js").status == 200);

  const std::string bearer = std::string("Authorization: Bearer ") + kToken + "\r\n";
  CHECK(scene.Get("/status.json", bearer).status == 200);
  CHECK(scene.Get("/status.json", "Authorization: Bearer wrong\r\n").status == 401);
  CHECK(
      scene.Get("/status.json", std::string("Authorization: Bearer ") + kToken + "x\r\n").status ==
      401);
  CHECK(scene.Get("/status.json", std::string("Authorization: Basic ") + kToken + "\r\n").status ==
        401);

  const std::string name = "plumbline-" + std::to_string(scene.port());
  const std::string cookie = name + "=" + http::CookieValueOf(kToken);
  for (const PageResponse& exchanged :
       {scene.Get("/?token=a-long-word%3B%3Dof%2Bour-own"), scene.Get("/login", bearer)}) {
    CHECK(exchanged.status == 303);
    CHECK(exchanged.Has("Location: /\r\n"));
    CHECK(exchanged.Has("Set-Cookie: " + cookie + "; "));
    CHECK(exchanged.Has("HttpOnly"));
    CHECK(exchanged.Has("SameSite=Strict"));
    CHECK_THAT(exchanged.head, !Contains(kToken));
  }
  CHECK(scene.Get("/?token=wrong").status == 401);
  CHECK(scene.Get("/status.json", "Cookie: a=b; " + cookie + "\r\n").status == 200);
  CHECK(scene.Get("/", "Cookie: " + cookie + "\r\n").body.find("headline") != std::string::npos);
  CHECK(scene.Get("/status.json", "Cookie: " + cookie + "0\r\n").status == 401);
  CHECK(scene.Get("/status.json", "Cookie: " + name + "=\r\n").status == 401);
  CHECK(scene.Get("/status.json", "Cookie: " + name + "=" + kToken + "\r\n").status == 401);
  // Wrong tokens are logged at most once a minute, without the token.
  const std::lock_guard lock(scene.log_mutex);
  REQUIRE(scene.logged.size() == 1);
  CHECK_THAT(scene.logged[0], Contains("wrong token by 127.0.0.1"));
}

TEST_CASE("guessing is slowed down, and a right token is refused, too, while waiting") {
  PageScene scene;
  scene.StartWithToken(kToken);
  scene.PublishStatus();
  const auto with = [&](const std::string& token) {
    return scene.Get("/status.json", "Authorization: Bearer " + token + "\r\n");
  };
  // Repeating the same wrong token is an outdated program, not a guess.
  for (int k = 0; k < 3 * http::LoginThrottle::kFreeFailures; ++k) CHECK(with("old").status == 401);
  CHECK(with(kToken).status == 200);
  for (int k = 0; k < http::LoginThrottle::kFreeFailures; ++k)
    CHECK(with(std::to_string(k)).status == 401);
  const PageResponse slowed = with("another");
  CHECK(slowed.status == 429);
  CHECK(slowed.Has("Retry-After: 1\r\n"));
  CHECK_THAT(slowed.body, Contains("try again in 1 s"));
  CHECK(with(kToken).status == 429);
  CHECK(scene.Get("/?token=guess").status == 429);
  CHECK(scene.Get("/").status == 401);  // the login page is still served
  CHECK(scene.Get("/page.css").status == 200);
  CHECK(HoldsSoon([&] { return with(kToken).status == 200; }));
}

TEST_CASE("a page reachable from other computers is not served with a weak token") {
  PageScene scene;
  PageOptions options = scene.Options();
  options.config.listen = "0.0.0.0";
  options.config.token =
      GENERATE("a-long-word-of-your-own", "correct-horse-battery-staple-42", "0123456789abcdef");
  const auto refused = Page::Start(options, scene.shown, nullptr);
  REQUIRE_FALSE(refused);
  CHECK_THAT(refused.error(), Contains("plumbline token") && !Contains(options.config.token));
}

TEST_CASE("without a token the page is served to this computer only") {
  PageScene scene;
  PageOptions options = scene.Options();
  options.config.listen = "0.0.0.0";
  const auto refused = Page::Start(options, scene.shown, nullptr);
  REQUIRE_FALSE(refused);
  CHECK_THAT(refused.error(), Contains("is reachable from other computers and needs a token"));
  // This includes a socket from the service manager, whatever the configuration says.
  auto held = os::TcpListener::Open("0.0.0.0", 0);
  REQUIRE(held);
  options = scene.Options();
  CHECK_FALSE(Page::Start(options, scene.shown, nullptr, os::Descriptor(dup(held.value().fd()))));
  options = scene.Options();
  auto local = os::TcpListener::Open("127.0.0.1", 0);
  REQUIRE(local);
  const int port = local.value().endpoint().port;
  scene.Start(options, os::Descriptor(dup(local.value().fd())));
  CHECK(scene.port() == port);
  CHECK(scene.Get("/").status == 200);
  options = scene.Options();
  options.config.port = port;
  const auto taken = Page::Start(options, scene.shown, nullptr);
  REQUIRE_FALSE(taken);
  CHECK_THAT(taken.error(), Contains("another program uses the port"));
}

TEST_CASE("a socket from the service manager keeps listening after the page has ended") {
  PageScene scene;
  auto held = os::TcpListener::Open("127.0.0.1", 0);
  REQUIRE(held);
  for (int run = 0; run < 2; ++run) {
    PageOptions options = scene.Options();
    os::Descriptor listener(dup(held.value().fd()));
    if (run == 1) {
      // A client that connects in between waits.
      PageConnection early(held.value().endpoint().port);
      early.Send("GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n");
      scene.Start(options, std::move(listener));
      CHECK(PageResponse(early.Read()).status == 503);
    } else {
      scene.Start(options, std::move(listener));
    }
    CHECK(scene.Get("/").status == 200);
    scene.page.reset();
  }
}

TEST_CASE("an unknown host name is refused, and so is a request without one") {
  PageScene scene;
  PageOptions options = scene.Options();
  options.config.hosts = {"cell7.plant.example"};
  scene.Start(options);
  const auto host = [&](const std::string& name) {
    return Request(scene.port(), "/status.json", "", "GET", name).status;
  };
  CHECK(host("127.0.0.1:" + std::to_string(scene.port())) == 200);
  CHECK(host("[::1]") == 200);
  CHECK(host("CELL7.plant.example:80") == 200);
  CHECK(host("evil.example") == 421);
  CHECK(host("cell7.plant.example.evil.example") == 421);
  CHECK(host("") == 400);
  CHECK(host("a b") == 400);
  CHECK(scene.Get("/", "Host: evil.example\r\n").status == 400);  // a second one
  PageConnection none(scene.port());
  none.Send("GET / HTTP/1.1\r\n\r\n");
  CHECK(PageResponse(none.Read()).status == 400);
}

TEST_CASE("the page is read-only: other methods are refused") {
  PageScene scene;
  scene.Start(scene.Options());
  for (const char* const method :
       {"POST", "PUT", "DELETE", "PATCH", "OPTIONS", "TRACE", "CONNECT"}) {
    INFO(method);
    const PageResponse answer =
        Request(scene.port(), "/status.json", "Content-Length: 5\r\n", method);
    CHECK(answer.status == 405);
    CHECK(answer.Has("Allow: GET, HEAD"));
  }
  CHECK(Request(scene.port(), "/", "", "BREW").status == 405);
}

TEST_CASE("oversized and malformed requests are refused") {
  PageScene scene;
  scene.Start(scene.Options());
  CHECK(scene.Get("/" + std::string(20000, 'a')).status == 431);
  CHECK(scene.Get("/", "X: " + std::string(20000, 'a') + "\r\n").status == 431);
  std::string many;
  for (int k = 0; k < 5000; ++k) many += "A: b\r\n";
  CHECK(scene.Get("/", many).status == 431);
  CHECK(scene.Get("/", "Content-Length: 5\r\n").status == 413);
  // Ranges and compression are ignored: a small request must not cause much work.
  for (const char* const part : {",0-", "0", ",1-2,\t3-", "-", ", "}) {
    std::string ranges = "Range: bytes=0-";
    while (ranges.size() < 7900) ranges += part;
    const PageResponse whole = scene.Get("/page.css", ranges + "\r\n");
    CHECK(whole.status == 200);
    CHECK(whole.body.size() < 10000);
  }
  CHECK_FALSE(scene.Get("/page.css", "Accept-Encoding: br, gzip\r\n").Has("Content-Encoding"));
  for (const std::string& none :
       {std::string("\r\n\r\n"), std::string("GET\r\n\r\n"), std::string("GET / HTTP/9.9\r\n\r\n"),
        std::string("\0\0\0\0\r\n\r\n", 8), std::string("\x16\x03\x01\x02\r\n\r\n"),
        std::string("GET / HTTP/1.1\r\nbroken\r\n\r\n")}) {
    PageConnection connection(scene.port());
    connection.Send(none);
    CHECK(PageResponse(connection.Read()).status != 200);
  }
  CHECK(scene.Get("/").status == 200);
}

TEST_CASE("a request may arrive byte by byte; of pipelined requests only the first is answered") {
  PageScene scene;
  scene.Start(scene.Options());
  PageConnection split(scene.port());
  for (const char c : std::string("GET /page.css HTTP/1.1\r\nHost: localhost\r\n\r\n")) {
    split.Send({c});
    SleepSeconds(0.001);
  }
  const PageResponse css(split.Read());
  CHECK(css.status == 200);
  PageConnection pipelined(scene.port());
  pipelined.Send(
      "GET /page.css HTTP/1.1\r\nHost: localhost\r\n\r\n"
      "GET /page.js HTTP/1.1\r\nHost: localhost\r\n\r\n");
  CHECK(PageResponse(pipelined.Read()).body == css.body);
  CHECK(pipelined.ended());
}

TEST_CASE("the host of an absolute target is checked") {
  PageScene scene;
  scene.Start(scene.Options());
  CHECK(Request(scene.port(), "http://localhost/", "", "GET", "evil.example").status == 200);
  CHECK(scene.Get("http://evil.example/").status == 421);
}

TEST_CASE("a client that closes without a request gets no response; after a partial one, 400") {
  PageScene scene;
  scene.Start(scene.Options());
  for (const char* const begun : {"", "GET / HTTP/1.1\r\n"}) {
    PageConnection connection(scene.port());
    connection.Send(begun);
    connection.EndSending();
    CHECK(PageResponse(connection.Read()).status == (*begun == '\0' ? 0 : 400));
    CHECK(connection.ended());
  }
}

TEST_CASE("a slow client is cut off and delays nobody else") {
  PageScene scene;
  PageOptions options = scene.Options();
  options.limits.request_s = 0.5;
  scene.Start(options);
  std::vector<std::unique_ptr<PageConnection>> slow;
  for (std::size_t k = 0; k + 1 < http::HttpServer::kMaxPerPeer; ++k) {
    slow.push_back(std::make_unique<PageConnection>(scene.port()));
    slow.back()->Send("GET / HTTP/1.1\r\n");
  }
  CHECK(scene.Get("/").status == 200);
  // A byte now and then does not help.
  PageConnection& patient = *slow.front();
  std::string response;
  REQUIRE(HoldsSoon([&] {
    patient.Send("X");
    response = patient.Read("", 0.05);
    return patient.ended();
  }));
  CHECK_THAT(response, Contains("HTTP/1.1 408"));
}

TEST_CASE("connections beyond the limit per address are rejected until others close") {
  PageScene scene;
  scene.Start(scene.Options());
  std::vector<std::unique_ptr<PageConnection>> idle;
  for (std::size_t k = 0; k < http::HttpServer::kMaxPerPeer; ++k) {
    idle.push_back(std::make_unique<PageConnection>(scene.port()));
  }
  REQUIRE(HoldsSoon([&] { return scene.Get("/").status != 200; }));
  idle.clear();
  REQUIRE(HoldsSoon([&] { return scene.Get("/").status == 200; }));
}

TEST_CASE("a client that does not read is dropped, and others are served meanwhile") {
  PageScene scene;
  PageOptions options = scene.Options();
  options.limits.write_s = 0.3;
  scene.Start(options);
  scene.PublishPicture(1, 2, 3, 0, {1280, 720});
  PageConnection stuck(scene.port());
  stuck.Send("GET /live.mjpg HTTP/1.1\r\nHost: localhost\r\n\r\n");
  REQUIRE(HoldsSoon([&] {
    scene.PublishPicture(1, 2, 3, 0, {1280, 720});
    return Exposition(scene.Get("/metrics").body).Value("plumbline_page_viewers") == 1;
  }));
  CHECK(HoldsSoon([&] {
    auto noise = std::make_shared<display::DisplayPicture>();
    noise->image.size = {1280, 720};
    noise->image.rgb.resize(std::size_t{1280} * 720 * 3);
    for (std::uint8_t& byte : noise->image.rgb) byte = static_cast<std::uint8_t>(rand());
    noise->time_s = MonotonicSeconds();
    scene.shown.Publish(std::shared_ptr<const display::DisplayPicture>(noise));
    return Exposition(scene.Get("/metrics").body).Value("plumbline_page_viewers") == 0;
  }));
}

TEST_CASE("the write timeout restarts with every byte taken, up to a total limit") {
  const bool endless = GENERATE(false, true);
  int ends[2];
  REQUIRE(socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) == 0);
  const int small = 4096;
  setsockopt(ends[0], SOL_SOCKET, SO_SNDBUF, &small, sizeof small);
  fcntl(ends[0], F_SETFL, O_NONBLOCK);
  http::ConnectionLimits limits;
  limits.write_s = endless ? 20 : 1.5;
  limits.answer_s = endless ? 0.3 : 300;
  http::HttpConnection connection(ends[0], limits, MonotonicSeconds());
  std::atomic<bool> stop{false};
  std::thread reader([&] {
    std::vector<char> bytes(4096);
    for (int k = 0; !stop && recv(ends[1], bytes.data(), bytes.size(), 0) > 0; ++k) {
      SleepSeconds(0.1);
    }
  });
  const std::string body(endless ? 10'000'000 : 120'000, 'x');
  const double begun_s = MonotonicSeconds();
  const bool written = connection.Write(body);
  const double took_s = MonotonicSeconds() - begun_s;
  stop = true;
  close(ends[0]);
  reader.join();
  close(ends[1]);
  if (endless) {
    CHECK_FALSE(written);
  } else {
    CHECK(written);
    CHECK(took_s > limits.write_s);  // else the test proves nothing
  }
}

TEST_CASE("if no thread can be started the client gets 503 and the slot is freed") {
  PageScene scene;
  scene.Start(scene.Options());
  pthread_attr_t usual, huge;
  pthread_getattr_default_np(&usual);
  pthread_attr_init(&huge);
  pthread_attr_setstacksize(&huge, std::size_t{1} << 46U);
  REQUIRE(pthread_setattr_default_np(&huge) == 0);
  for (int k = 0; k < 40; ++k) {
    PageConnection connection(scene.port());
    CHECK(PageResponse(connection.Read()).status == 503);
  }
  REQUIRE(pthread_setattr_default_np(&usual) == 0);
  CHECK(scene.Get("/").status == 200);
  CHECK(HoldsSoon([&] {
    return Exposition(scene.Get("/metrics").body).Value("plumbline_page_connections") == 1;
  }));
}

}  // namespace plumbline::page_access_test
