#include "app/display/view_process/page_host.h"

#include "tests/app/display/page/page_scene.h"

namespace plumbline::page_host_test {

using namespace plumbline::display;
using namespace plumbline::test;

TEST_CASE("a taken port is logged once, and the page is served when the port becomes free") {
  PageScene scene;
  scene.Start(scene.Options());  // has the port
  std::vector<std::string> bad, good;
  PageHost host(scene.shown, {}, [&](const log::LogEntry& entry) {
    (entry.event == log::Event::kPageFault ? bad : good).push_back(entry.text);
  });
  config::DaemonConfig config;
  config.page.port = scene.port();
  config.state_directory = scene.StateDirectory();
  host.Open(config);
  double now_s = MonotonicSeconds();
  for (int k = 0; k < 3; ++k) host.Poll(now_s += 2 * PageHost::kRetry_s);
  REQUIRE(bad.size() == 1);
  CHECK(bad[0].find("another program uses the port") != std::string::npos);
  CHECK(host.page() == nullptr);
  scene.page.reset();
  host.Poll(MonotonicSeconds());
  CHECK(host.page() == nullptr);  // not yet
  host.Poll(now_s + 2 * PageHost::kRetry_s);
  CHECK(host.page() != nullptr);
  CHECK(good.size() == 1);
}

TEST_CASE("a reload retries an unserved page at once and keeps an unchanged one open") {
  PageScene scene;
  scene.Start(scene.Options());
  int served = 0;
  PageHost host(scene.shown, {}, [&](const log::LogEntry& entry) {
    served += entry.event == log::Event::kPageServed ? 1 : 0;
  });
  config::DaemonConfig config;
  config.page.port = scene.port();
  config.state_directory = scene.StateDirectory();
  host.Open(config);
  scene.page.reset();
  host.Open(config);
  CHECK(served == 1);
  host.Open(config);
  CHECK(served == 1);
  config.machine.cell.robot.joints.resize(7);
  host.Open(config);
  CHECK(served == 2);
}

}  // namespace plumbline::page_host_test
