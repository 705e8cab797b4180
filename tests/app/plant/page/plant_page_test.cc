// The plant's page over a real database.
#include "app/plant/page/plant_page.h"

#include "app/base/text/json_text.h"
#include "tests/app/plant/page/plant_page_scene.h"

namespace plumbline::plant_page_test {

using namespace plumbline::test;
using Catch::Contains;

TEST_CASE("the wall is complete at once, follows the database, and survives its loss") {
  if (PostgresPrograms().empty()) {
    WARN("SKIPPED: no PostgreSQL 15 here");
    return;
  }
  PlantPageScene scene(60);
  const PageResponse whole = scene.Get("/");
  REQUIRE(whole.status == 200);
  CHECK_THAT(whole.body, Contains("No cell needs a person") && Contains("id=\"c60\"") &&
                             Contains("href=\"http://10.0.0.60:8080/\""));
  CHECK(whole.Has("Content-Security-Policy: default-src 'none'; script-src 'self'"));
  CHECK(whole.Has("X-Content-Type-Options: nosniff"));
  CHECK(Request(scene.page->at().port, "/", "", "POST").status == 405);
  CHECK(Request(scene.page->at().port, "/", "", "GET", "evil.example").status == 421);
  for (const char* const path : {"/page.css", "/wall.js", "/icon.svg", "/healthz"}) {
    CHECK(scene.Get(path).status == 200);
  }
  CHECK(scene.Get("/nothing").status == 404);
  const auto status = text::JsonOrNull(scene.Get("/status.json").body);
  CHECK(status.at("cells").size() == 60);
  CHECK_FALSE(status.contains("jobs"));  // not read, so not stated
  CHECK_FALSE(status.contains("unreadable"));

  PageConnection stream(scene.page->at().port);
  stream.Send("GET /events HTTP/1.1\r\nHost: localhost\r\n\r\n");
  CHECK_THAT(stream.Read("\n\n"), Contains("text/event-stream") && Contains("id=\\\"c60\\\""));
  scene.SetHealth(7, 3, "robot data stale");
  CHECK_THAT(stream.Read("robot data stale"), Contains("1 cell needs a person"));
  CHECK_THAT(scene.Get("/update.json?since=other-5").body, Contains("id=\\\"c1\\\""));

  scene.server.Stop(SIGINT);
  CHECK_THAT(stream.Read("\"headline\":\"LOST\""),
             Contains("the plant's database does not answer"));
  CHECK(scene.Get("/healthz").status == 503);
  CHECK_THAT(scene.Get("/").body, Contains("class=\"lost\"") && Contains("id=\"c60\""));
  scene.server.Start();
  CHECK(Soon([&] { return scene.Get("/healthz").status == 200; }));
  const std::lock_guard lock(scene.log_mutex);
  REQUIRE(scene.logged.size() == 2);
  CHECK_THAT(scene.logged[1], Contains("answers again"));
}

TEST_CASE("a token is required where one is configured; streams are limited") {
  if (PostgresPrograms().empty()) {
    WARN("SKIPPED: no PostgreSQL 15 here");
    return;
  }
  PlantPageScene scene(3, "0123456789abcdef0123456789abcdef");
  CHECK(scene.Get("/").status == 401);
  CHECK_THAT(scene.Get("/").body, Contains("type=\"password\""));
  for (const char* const path : {"/events", "/update.json", "/status.json", "/wall.js"}) {
    CHECK(scene.Get(path).status == 401);
  }
  const std::string bearer = "Authorization: Bearer 0123456789abcdef0123456789abcdef\r\n";
  CHECK(scene.Get("/", bearer).status == 200);
  std::vector<std::unique_ptr<PageConnection>> streams;
  const std::string request = "GET /events HTTP/1.1\r\nHost: localhost\r\n" + bearer + "\r\n";
  for (int k = 0; k < plant::PlantPage::kMaxStreamsPerPeer; ++k) {
    streams.push_back(std::make_unique<PageConnection>(scene.page->at().port));
    streams.back()->Send(request);
    CHECK_THAT(streams.back()->Read("\n\n"), Contains("event-stream"));
  }
  CHECK(scene.Get("/events", bearer).status == 503);
  CHECK(scene.Get("/", bearer).status == 200);
  streams.clear();
  CHECK(Soon([&] {
    PageConnection again(scene.page->at().port);
    again.Send(request);
    return again.Read("\n\n").find("event-stream") != std::string::npos;
  }));
}

TEST_CASE("an address that others reach is not served without a token") {
  plant::PlantPageOptions options;
  options.page.listen = "0.0.0.0";
  options.page.port = 0;
  options.log = [](const std::string&) {};
  const auto refused = plant::PlantPage::Start(std::move(options));
  REQUIRE_FALSE(refused);
  CHECK_THAT(refused.error(), Contains("needs a token"));
}

}  // namespace plumbline::plant_page_test
