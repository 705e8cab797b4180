// Responses of the page over real sockets.
#include "app/display/page/page.h"

#include "app/base/text/json_text.h"
#include "app/cell/journal/journal.h"
#include "app/display/page/residual_trend.h"
#include "app/display/page/status_json.h"
#include "drivers/camera/jpeg_image.h"
#include "tests/app/display/page/exposition.h"
#include "tests/app/display/page/page_scene.h"

namespace plumbline::page_test {

using namespace plumbline::display;
using namespace plumbline::test;
using Catch::Contains;

namespace {

/// Splits a multipart stream into its JPEG files by their Content-Length.
std::vector<std::string> SplitMultipart(const std::string& body) {
  std::vector<std::string> parts;
  constexpr std::string_view kHead = "--frame\r\nContent-Type: image/jpeg\r\nContent-Length: ";
  std::size_t at = 0;
  while (body.compare(at, kHead.size(), kHead) == 0) {
    const std::size_t end = body.find("\r\n\r\n", at);
    if (end == std::string::npos) break;
    const std::size_t size = std::stoul(body.substr(at + kHead.size()));
    if (end + 4 + size + 2 > body.size()) break;
    parts.push_back(body.substr(end + 4, size));
    at = end + 4 + size;
    REQUIRE(body.substr(at, 2) == "\r\n");
    at += 2;
  }
  return parts;
}

/// Luma at the centre of a JPEG of the size that PageScene::PublishPicture() makes.
double LumaOf(const std::string& jpeg) {
  camera::GreyImage image;
  const auto decoded = camera::DecodeJpegFile(
      {reinterpret_cast<const std::uint8_t*>(jpeg.data()), jpeg.size()}, image);
  INFO((decoded ? std::string() : decoded.error()));
  REQUIRE(decoded);
  REQUIRE(image.width == 320);
  REQUIRE(image.height == 180);
  return image.grey[90 * 320 + 160];
}

}  // namespace

TEST_CASE("page, files and security headers; nothing is loaded from other origins") {
  PageScene scene;
  scene.Start(scene.Options());
  const PageResponse page = scene.Get("/");
  CHECK(page.status == 200);
  CHECK(page.Has("Content-Type: text/html"));
  CHECK(page.Has("Content-Security-Policy: default-src 'none'; script-src 'self'"));
  CHECK(page.Has("frame-ancestors 'none'"));
  CHECK(page.Has("X-Content-Type-Options: nosniff"));
  CHECK(page.Has("Cross-Origin-Resource-Policy: same-origin"));
  CHECK(page.Has("Connection: close"));
  CHECK_THAT(page.body, Contains("<h1 id=\"headline\"") && Contains("lang=\"en\""));
  for (const char* const path : {"/page.css", "/page.js", "/pictures.js", "/trend.js",
                                 "/cameras.js", "/login.js", "/icon.svg"}) {
    INFO(path);
    const PageResponse file = scene.Get(path);
    CHECK(file.status == 200);
    CHECK(file.body.size() > 100);
    CHECK_THAT(file.body, !Contains("innerHTML") && !Contains("eval("));
    // The only URL is the SVG namespace.
    const std::size_t address = file.body.find("http");
    if (address != std::string::npos) {
      CHECK(file.body.compare(address, 22, "http://www.w3.org/2000") == 0);
    }
  }
  // The chart library names its licence only, and loads nothing.
  const PageResponse chart = scene.Get("/chart.js");
  CHECK(chart.status == 200);
  CHECK(chart.body.rfind("http") == chart.body.find("https://github.com/danvk/dygraphs/blob/"));
  CHECK_THAT(chart.body, !Contains("eval(") && !Contains("sourceMappingURL"));
  CHECK_THAT(page.body, !Contains("http:") && !Contains("https:"));
  CHECK(scene.Get("/nothing").status == 404);
  CHECK(scene.Get("/live.mjpg/").status == 404);
  const PageResponse head = Request(scene.port(), "/", "", "HEAD");
  CHECK(head.status == 200);
  CHECK(head.Has("Content-Length: " + std::to_string(page.body.size())));
  CHECK(head.body.empty());
}

TEST_CASE("status.json has the display's texts, the values, and the log of several states") {
  PageScene scene;
  scene.Start(scene.Options());
  CHECK_THAT(text::JsonOrNull(scene.Get("/status.json").body).at("headline").at("text"),
             Contains("STARTING"));
  CHECK(scene.Get("/healthz").status == 503);
  scene.scene.state.warnings = warning::kDrift;
  scene.scene.state.health = HealthOf({.warnings = warning::kDrift});
  scene.PublishStatus();
  const PageResponse answer = scene.Get("/status.json");
  CHECK(answer.Has("Content-Type: application/json"));
  auto json = text::JsonOrNull(answer.body);
  CHECK(json.at("daemon").at("there") == true);
  CHECK(json.at("cell") == "demo cell");
  CHECK(json.at("headline").at("tone") == "attention");
  CHECK(json.at("strip").at("class") == "warning");
  CHECK(json.at("strip").at("glyph") == "▲");
  CHECK(json.at("strip").at("word") == "ATTENTION");
  CHECK(json.at("strip").at("reason") == "drift: probes no longer agree with the model");
  CHECK(json.at("tiles")[0].at("name") == "assembly 1");
  CHECK(json.at("tiles")[0].at("value") == "4.15 mm");
  CHECK(json.at("tiles")[0].at("radius") == "±0.30 mm (95 %, measured)");
  CHECK(json.at("panels").size() == 7);
  CHECK(json.at("panels")[0].at("title") == "Alarms and warnings");
  CHECK(json.at("robot").at("payload_kg") == 40);
  CHECK(json.at("headline").at("text") ==
        "ATTENTION: drift: probes no longer agree with the model");
  CHECK(json.at("health").at("severity") == 2);
  CHECK(json.at("points")[0].at("uncertainty_m") == Approx(0.0003));
  CHECK(json.at("points")[0].at("basis") == "measured");
  CHECK(json.at("points")[0].at("posture").at("q")[1] == Approx(-100 * kRadPerDeg));
  CHECK(json.at("points")[0].at("posture").at("joints")[1].at("value") == Approx(-100));
  CHECK(json.at("points")[0].at("posture").at("joints")[1].at("unit") == "deg");
  CHECK(json.at("points")[0].at("posture").at("differs") == false);
  CHECK(json.at("cameras")[0].at("serial") == "test camera");
  CHECK(json.at("cameras")[0].at("lens_valid") == true);
  CHECK(json.at("cameras")[0].at("usable_radius_px").is_null());
  CHECK(json.at("cameras")[0].at("tags") == nlohmann::json{0, 1, 20});
  CHECK(json.at("picture").at("age_s").is_null());
  CHECK(json.at("log").size() == 3);
  CHECK(scene.Get("/healthz").status == 200);
  scene.scene.state.cameras[0].usable_radius_px = 700.5;
  scene.PublishStatus();
  json = text::JsonOrNull(scene.Get("/status.json").body);
  CHECK(json.at("cameras")[0].at("usable_radius_px") == 700.5);
  CHECK_THAT(json.at("panels").dump(), Contains("usable up to 700 px from the middle"));
  // A restarted daemon counts its lines from 1; the earlier ones are kept.
  scene.scene.state.lines = {{1, 1.8e9, 5, "plumblined 0.1.0 again"}};
  scene.PublishStatus();
  json = text::JsonOrNull(scene.Get("/status.json").body);
  REQUIRE(json.at("log").size() == 4);
  CHECK(json.at("log")[3].at("text") == "plumblined 0.1.0 again");
}

TEST_CASE("the cameras are listed once each, with a command that a shell takes literally") {
  camera::V4l2Device usual{"/dev/video0", "Camera", "", "A1B2C3", "046d:0825", "1-2", ""};
  camera::V4l2Device metadata = usual;
  metadata.path = "/dev/video1";
  const camera::V4l2Device unnamed{"/dev/video2", "Other", "", "", "046d:0825", "1-3", ""};
  const camera::V4l2Device hostile{"/dev/video3", "Evil", "", "$(reboot)", "1:2", "1-4", ""};
  const camera::V4l2Device numbered{"/dev/video4", "Camera", "", "2", "1:2", "1-5", ""};
  const camera::V4l2Device option{"/dev/video5", "Camera", "", "--json", "1:2", "1-6", ""};
  const camera::V4l2Device built_in{"/dev/video6", "unicam", "", "", "", "", ""};
  const auto json = text::JsonOrNull(
      CameraListJson({usual, metadata, unnamed, hostile, numbered, option, built_in}));
  const auto& cameras = json.at("cameras");
  REQUIRE(cameras.size() == 6);
  CHECK(cameras[0] == nlohmann::json{{"name", "Camera"},
                                     {"device", "/dev/video0"},
                                     {"select", "A1B2C3"},
                                     {"serial", "A1B2C3"},
                                     {"port", "1-2"},
                                     {"command", "plumbline cameras --choose A1B2C3"}});
  CHECK(cameras[1].at("command") == "plumbline cameras --choose 046d:0825@1-3");
  CHECK(cameras[2].at("command").is_null());
  CHECK(cameras[3].at("command") == "plumbline cameras --choose 2@1-5");
  CHECK(cameras[4].at("command").is_null());
  CHECK(cameras[5].at("command") == "plumbline cameras --choose /dev/video6");
}

TEST_CASE("the page lists the cameras of this computer without opening them") {
  PageScene scene;
  PageOptions options = scene.Options();
  options.cameras.sysfs = scene.StateDirectory() + "/video4linux";
  scene.Write("video4linux/video0/name", "Camera\n");
  scene.Start(options);
  const auto json = text::JsonOrNull(scene.Get("/cameras.json").body);
  REQUIRE(json.at("cameras").size() == 1);
  CHECK(json.at("cameras")[0].at("name") == "Camera");
  CHECK(json.at("cameras")[0].at("command") == "plumbline cameras --choose /dev/video0");
  CHECK(Request(scene.port(), "/cameras.json", "", "POST").status == 405);
}

TEST_CASE("log lines keep their order of arrival when the clock is set back") {
  LogTail tail;
  display::DisplayStatus now;
  cell::ViewState state;
  now.viewer_lines = {{1, 500, 5, "quiet viewer"}};
  for (std::size_t k = 0; k < LogTail::kMaxLines; ++k) {
    state.lines = {{k + 1, 1000.0 + static_cast<double>(k), 5, "before"}};
    now.state = std::make_shared<const cell::ViewState>(state);
    tail.Add(now);
  }
  state.lines.push_back({LogTail::kMaxLines + 1, 10, 5, "after"});
  now.state = std::make_shared<const cell::ViewState>(state);
  tail.Add(now);
  tail.Add(now);
  const std::vector<RecentLogEntry> lines = tail.Lines();
  REQUIRE(lines.size() == LogTail::kMaxLines);
  CHECK(lines.back().text == "after");
  for (const RecentLogEntry& line : lines) CHECK(line.text != "quiet viewer");
}

TEST_CASE("log lines are collected without viewers; each start of the server has its own id") {
  PageScene scene;
  scene.Start(scene.Options());
  scene.scene.state.lines = {{1, 1.8e9, 5, "first"}};
  scene.PublishStatus();
  scene.page->CollectLog();
  scene.scene.state.lines = {{2, 1.8e9, 5, "second"}};
  scene.PublishStatus();
  const auto json = text::JsonOrNull(scene.Get("/status.json").body);
  CHECK_THAT(text::JsonText(json.at("log")), Contains("first") && Contains("second"));
  scene.page.reset();
  scene.Start(scene.Options());
  CHECK(text::JsonOrNull(scene.Get("/status.json").body).at("page").at("start") !=
        json.at("page").at("start"));
}

TEST_CASE("a silent daemon and an old picture are reported") {
  PageScene scene;
  scene.Start(scene.Options());
  scene.PublishStatus(60, "plumblined closed the connection");
  scene.PublishPicture(0, 0, 0, 90);
  const auto json = text::JsonOrNull(scene.Get("/status.json").body);
  CHECK(json.at("daemon").at("there") == false);
  CHECK(json.at("daemon").at("age_s") > 59);
  CHECK_THAT(json.at("headline").at("text"), Contains("NO DAEMON: plumblined closed"));
  CHECK(json.at("headline").at("tone") == "bad");
  CHECK(json.at("health").at("severity") == 3);
  CHECK(json.at("health").at("word") == "ALARM");
  CHECK(json.at("health").at("reason") == "no daemon");
  CHECK(json.at("robot").at("data_age_s") > 59);
  REQUIRE_FALSE(json.at("points").empty());
  for (const auto& point : json.at("points")) {
    CHECK(point.at("valid") == false);
    CHECK(point.at("reason") == "no daemon");
    CHECK(point.at("tone") == "bad");
    CHECK_FALSE(point.contains("uncertainty_m"));
  }
  const std::string panels = text::JsonText(json.at("panels"));
  CHECK_THAT(panels, Contains("last robot reading 60 s ago"));
  CHECK_THAT(panels, !Contains("measured\""));
  CHECK(json.at("picture").at("age_s") > 89);
  CHECK(json.at("view").at("age_s") < 20);
  CHECK(scene.Get("/healthz").status == 503);
  CHECK(scene.Get("/picture.jpg").status == 503);
  const Exposition metrics(scene.Get("/metrics").body);
  CHECK(metrics.problem.empty());
  CHECK(metrics.Value("plumbline_up") == 0);
}

TEST_CASE("a hanging viewer withdraws its daemon's state") {
  PageScene scene;
  cell::ViewState& state = scene.scene.state;
  cell::Carriers carriers = scene.scene.Placed();
  display::ViewFacts facts;
  facts.state = &state;
  facts.carriers = std::span(&carriers, 1);
  facts.model = &*scene.scene.model;
  facts.now_s = ViewScene::kNow_s;
  const display::DisplayStatus shown = display::MakeDisplayStatus(facts, "");
  const auto at = [&](double now_s) { return text::JsonOrNull(StatusJson(&shown, {}, {}, now_s)); };
  const auto now = at(facts.now_s);
  CHECK(now.at("health").at("severity") < 3);
  CHECK(now.at("points")[0].at("valid") == true);
  const auto later = at(facts.now_s + 5);
  CHECK(later.at("health").at("reason") == "no daemon");
  CHECK(later.at("headline").at("tone") == "bad");
  CHECK(later.at("points")[0].at("valid") == false);
  CHECK(later.at("robot").at("data_age_s") > 4.9);
}

TEST_CASE("metrics over HTTP") {
  PageScene scene;
  scene.Start(scene.Options());
  scene.PublishStatus();
  const PageResponse answer = scene.Get("/metrics");
  CHECK(answer.status == 200);
  CHECK(answer.Has("Content-Type: text/plain; version=0.0.4"));
  const Exposition read(answer.body);
  CHECK(read.problem.empty());
  CHECK(read.Value("plumbline_up") == 1);
  CHECK(read.Value("plumbline_page_requests_total") == 1);
  CHECK(read.Value("plumbline_page_connections") == 1);
}

TEST_CASE("the live picture is valid JPEG, always the newest, and encoded once for all viewers") {
  PageScene scene;
  scene.Start(scene.Options());
  CHECK_FALSE(scene.shown.PictureRequested(MonotonicSeconds()));
  PageConnection first(scene.port()), second(scene.port());
  for (const PageConnection* viewer : {&first, &second}) {
    viewer->Send("GET /live.mjpg HTTP/1.1\r\nHost: localhost\r\n\r\n");
  }
  // Pictures are drawn on request only.
  REQUIRE(HoldsSoon([&] { return scene.shown.PictureRequested(MonotonicSeconds()); }));
  scene.PublishPicture(255, 255, 255);
  const auto white = SplitMultipart(PageResponse(first.Read("\r\n--frame")).body);
  REQUIRE_FALSE(white.empty());
  CHECK(LumaOf(white[0]) > 250);
  scene.PublishPicture(0, 0, 0);
  std::vector<std::string> parts;
  REQUIRE(HoldsSoon([&] {
    parts = SplitMultipart(PageResponse(first.Read("", 0.02)).body);
    return parts.size() >= 3;
  }));
  CHECK(LumaOf(parts.back()) < 5);
  std::vector<std::string> other;
  REQUIRE(HoldsSoon([&] {
    other = SplitMultipart(PageResponse(second.Read("", 0.02)).body);
    return !other.empty() && other.back() == parts.back();
  }));
  const Exposition metrics(scene.Get("/metrics").body);
  CHECK(metrics.Value("plumbline_page_viewers") == 2);
  const PageResponse one = scene.Get("/picture.jpg");
  CHECK(one.Has("Content-Type: image/jpeg"));
  CHECK(one.body == parts.back());
}

TEST_CASE("the feed limits the picture rate") {
  PageScene scene;
  PictureFeed feed(scene.shown);
  CHECK(feed.Newest(0) == nullptr);
  scene.PublishPicture(10, 20, 30);
  const auto first = feed.Newest(1);
  REQUIRE(first);
  CHECK(feed.Newest(1) == first);
  scene.PublishPicture(40, 50, 60);
  CHECK(feed.Newest(1.05) == first);
  CHECK(feed.Newest(1.1)->number == 2);
  CHECK(feed.Newest(9)->number == 2);
  CHECK(JpegOf({}).empty());
  CHECK(JpegOf({{1, 2, 3}, {2, 2}}).empty());
}

TEST_CASE("viewers beyond the limit are refused until one leaves") {
  PageScene scene;
  scene.Start(scene.Options());
  std::vector<std::unique_ptr<PageConnection>> viewers;
  for (int k = 0; k < Page::kMaxViewers; ++k) {
    viewers.push_back(std::make_unique<PageConnection>(scene.port()));
    viewers.back()->Send("GET /live.mjpg HTTP/1.1\r\nHost: localhost\r\n\r\n");
    viewers.back()->Read("\r\n\r\n");
  }
  CHECK(scene.Get("/live.mjpg").status == 503);
  CHECK(scene.Get("/status.json").status == 200);
  viewers.pop_back();
  REQUIRE(HoldsSoon([&] {
    return Exposition(scene.Get("/metrics").body).Value("plumbline_page_viewers") <
           Page::kMaxViewers;
  }));
}

TEST_CASE(
    "the trend is read from the journal; a missing journal is empty, a damaged one reported") {
  PageScene scene;
  scene.Start(scene.Options());
  CHECK(text::JsonOrNull(scene.Get("/trend.json").body).at("points").empty());
  scene.page.reset();
  const std::vector<model::Joint>& joints = scene.scene.model->config.machine.cell.robot.joints;
  {
    auto journal = cell::Journal::Open(scene.StateDirectory() + "/journal.sqlite");
    REQUIRE(journal);
    cell::JournalRow row;
    row.q = scene.scene.state.q;
    row.unix_ms = 1'800'000'000'000;
    row.session = "1";
    row.predicted_W = Vec3(1, 2, 3);
    row.measured_W = Vec3(1.0003, 2, 3.0004);
    row.model_version = 2;
    row.payload_kg = 12.5;
    // Rows of an earlier arm with another number of joints, and enough rows without a prediction to
    // fill the newest ones: the trend skips both.
    cell::JournalRow foreign = row;
    foreign.q = model::JointVector::Zero(row.q.size() - 1);
    const std::vector<model::Joint> fewer(joints.begin(), joints.end() - 1);
    REQUIRE(journal.value().Append({foreign}, fewer));
    cell::JournalRow unpredicted = row;
    unpredicted.predicted_W.reset();
    unpredicted.model_version.reset();
    std::vector<cell::JournalRow> rows(kTrendRows + 2, unpredicted);
    rows.front() = rows.back() = row;
    const auto last = journal.value().Append(rows, joints);
    REQUIRE(last);
    REQUIRE(journal.value().Mark(*last, true, true));
  }
  scene.Start(scene.Options());
  const auto json = text::JsonOrNull(scene.Get("/trend.json").body);
  REQUIRE(json.at("points").size() == 2);
  CHECK(json.at("points")[0].at("mm") == Approx(0.5));
  CHECK(json.at("points")[0].at("model") == 2);
  CHECK(json.at("points")[0].at("payload_kg") == 12.5);
  CHECK(json.at("points")[0].at("alarm") == false);
  CHECK(json.at("points")[1].at("alarm") == true);
  CHECK(json.at("points")[1].at("wild") == true);
  scene.page.reset();
  scene.Write("journal.sqlite", "not a journal, but text that is long enough to be recognised");
  scene.Start(scene.Options());
  CHECK_FALSE(
      text::JsonOrNull(scene.Get("/trend.json").body).at("problem").get<std::string>().empty());
}

TEST_CASE("reports are listed and served, and no name leaves their folders") {
  PageScene scene;
  scene.Write("models/0007.html", "<p>seven</p>");
  scene.Write("models/0008.html", "<p>eight</p>");
  scene.Write("models/0008.toml", "secret");
  scene.Write("diagnosis/report.html", "<p>newest</p>");
  scene.Write("alarms/alarm-20261121T120000Z-0041-1.png", "png");
  scene.Write("secret.html", "secret");
  std::filesystem::create_symlink(scene.StateDirectory() + "/secret.html",
                                  scene.StateDirectory() + "/models/0009.html");
  std::filesystem::create_directory(scene.StateDirectory() + "/models/0010.html");
  scene.Start(scene.Options());
  const auto list = text::JsonOrNull(scene.Get("/reports.json").body).at("reports");
  REQUIRE(list.size() == 4);
  CHECK(list[0].at("name") == "diagnosis.html");
  CHECK(list[1].at("name") == "0008.html");
  CHECK(list[2].at("name") == "0007.html");
  CHECK(list[2].at("bytes") == 12);
  CHECK(list[3].at("kind") == "alarm");
  const PageResponse report = scene.Get("/reports/0007.html");
  CHECK(report.body == "<p>seven</p>");
  CHECK(report.Has("Content-Security-Policy: default-src 'none'; style-src 'unsafe-inline'"));
  CHECK(report.Has("sandbox"));
  CHECK(scene.Get("/reports/diagnosis.html").body == "<p>newest</p>");
  CHECK(scene.Get("/reports/alarm-20261121T120000Z-0041-1.png").Has("Content-Type: image/png"));
  for (const char* const path :
       {"/reports/", "/reports/0009.html", "/reports/0010.html", "/reports/0011.html",
        "/reports/../secret.html", "/reports/%2e%2e/secret.html", "/reports/..%2fsecret.html",
        "/reports/0008.toml", "/reports/0007.html%00.png", "/reports//etc/passwd", "/reports/%",
        "/../etc/passwd", "/reports/....//secret.html", "/reports\\..\\secret.html"}) {
    INFO(path);
    const PageResponse answer = scene.Get(path);
    CHECK((answer.status == 404 || answer.status == 400));
    CHECK_THAT(answer.body, !Contains("secret"));
  }
}

}  // namespace plumbline::page_test
