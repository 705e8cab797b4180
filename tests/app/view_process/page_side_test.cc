#include "app/view_process/page_side.h"

#include "tests/app/page/page_scene.h"

using namespace plumbline;
using namespace plumbline::test;

TEST_CASE("a page whose port is taken is told once, tried again, and served when it is free") {
  PageScene scene;
  scene.Start(scene.Options());  // has the port
  std::vector<std::string> bad, good;
  PageSide side(scene.shown, {}, [&](const LogEntry& entry) {
    (entry.event == Event::kPageFault ? bad : good).push_back(entry.text);
  });
  DaemonConfig config;
  config.page.port = scene.port();
  config.state_directory = scene.StateDirectory();
  side.Open(config);
  double now_s = MonotonicSeconds();
  for (int k = 0; k < 3; ++k) side.Round(now_s += 2 * PageSide::kRetry_s);
  REQUIRE(bad.size() == 1);
  CHECK(bad[0].find("another program uses the port") != std::string::npos);
  CHECK(side.page() == nullptr);
  scene.page.reset();
  side.Round(MonotonicSeconds());
  CHECK(side.page() == nullptr);  // not yet
  side.Round(now_s + 2 * PageSide::kRetry_s);
  CHECK(side.page() != nullptr);
  CHECK(good.size() == 1);
}

TEST_CASE("a reload tries a page that is not served at once, and keeps one that is the same") {
  PageScene scene;
  scene.Start(scene.Options());
  int served = 0;
  PageSide side(scene.shown, {}, [&](const LogEntry& entry) {
    served += entry.event == Event::kPageServed ? 1 : 0;
  });
  DaemonConfig config;
  config.page.port = scene.port();
  config.state_directory = scene.StateDirectory();
  side.Open(config);
  scene.page.reset();
  side.Open(config);
  CHECK(served == 1);
  side.Open(config);
  CHECK(served == 1);
  config.machine.cell.robot.joints.resize(7);
  side.Open(config);
  CHECK(served == 2);
}
