// The wall of 300 cells in headless Chromium: phone, desk and 4K, light and dark.
#include "tests/app/display/page/browser.h"
#include "tests/app/display/page/contrast.h"
#include "tests/app/plant/page/plant_page_scene.h"

namespace plumbline::plant_page_browser_test {

using namespace plumbline::test;

namespace {

bool CanBrowsePlant() {
  if (BrowserProgram() && !PostgresPrograms().empty()) return true;
  WARN("SKIPPED: chromium or PostgreSQL 15 is not installed");
  return false;
}

/// Cells in every state, and one with a hostile name.
void MakeTrouble(PlantPageScene& scene) {
  scene.SetHealth(5, 3, "robot data stale");
  scene.SetHealth(17, 2, "probes no longer agree with the model");
  scene.Run("UPDATE cell SET state = state || '{\"drift_statistic\": 1.7}' WHERE cell = 17");
  scene.SetHealth(120, 2, "camera: do not use its measurements");
  scene.Run("INSERT INTO camera_now VALUES (120, 'left', now(), 'stale', 'views off by 2.1 px')");
  scene.Run(
      "UPDATE cell SET death = birth, clean_shutdown = cell = 202, "
      "last_received = now() - interval '3 hours', state_utc = now() - interval '3 hours' WHERE "
      "cell IN (201, 202)");
  scene.Run(
      "INSERT INTO stream (cell, stream, first_seq, next_seq, dropped) VALUES (60, 1, 1, 1000, "
      "20)");
  scene.Run("INSERT INTO gap VALUES (60, 1, 100, 149, now() - interval '1 day')");
  scene.Run(
      "UPDATE cell SET health = 1, state = state || '{\"proposed_model\": 4}' "
      "WHERE cell IN (70, 71)");
  scene.SetHealth(99, 2, "<img src=x onerror=alert(1)>");
  scene.Run(
      "UPDATE cell SET page = 'javascript:alert(1)', "
      "name = '<script>document.title=1</script> a name of more than usual length'"
      "WHERE cell = 99");
}

}  // namespace

TEST_CASE(
    "the wall is complete and legible from phone to 4K, light and dark, and follows changes") {
  if (!CanBrowsePlant()) return;
  PlantPageScene scene(300);
  MakeTrouble(scene);
  REQUIRE(Soon([&] { return scene.Get("/").body.find("6 cells need") != std::string::npos; }));
  for (const int width : {400, 1920, 3840}) {
    for (const bool dark : {false, true}) {
      CAPTURE(width, dark);
      const bool phone = width == 400;
      Browser browser(width, phone ? 844 : width * 9 / 16, phone, dark);
      browser.Open(scene.Address());
      REQUIRE(browser.Becomes("document.querySelectorAll('.card').length === 300"));
      CHECK(browser.Evaluate("document.documentElement.scrollWidth <= window.innerWidth") == true);
      CHECK(browser.Evaluate(kLeastContrast) >= 4.5);
      CHECK(browser.Evaluate("[...document.querySelectorAll('[data-list=person] .card')]"
                             ".map((card) => card.id).join()") == "c5,c17,c60,c99,c120,c201");
      CHECK(browser.Evaluate("document.getElementById('c99').querySelector('a') === null") == true);
      browser.Keep(fmt::format("wall-{}{}", width, dark ? "-dark" : ""), true);
      INFO(text::JsonText(nlohmann::json(browser.console_errors())));
      CHECK(browser.console_errors().empty());
    }
  }
}

TEST_CASE("changes are shown, cells move between the lists, and the selection stays") {
  if (!CanBrowsePlant()) return;
  PlantPageScene scene(60);
  Browser browser(1280, 800, false, false);
  browser.Open(scene.Address());
  REQUIRE(browser.Becomes("document.querySelectorAll('[data-list=rest] .card').length === 60"));
  scene.SetHealth(9, 2, "drift");
  scene.SetHealth(30, 3, "stop");
  CHECK(
      browser.Becomes("[...document.querySelectorAll('[data-list=person] .card')]"
                      ".map((card) => card.id).join() === 'c30,c9'"));
  scene.SetHealth(30, 0, "");
  CHECK(browser.Becomes("document.querySelector('[data-list=person]').children.length === 1"));
  // The list is the server's, also after many moves.
  CHECK(browser.Evaluate("(async () => { const text = await (await fetch('/')).text();"
                         "const ids = (root) => [...root.querySelectorAll('.card')]"
                         ".map((card) => card.id).join();"
                         "return ids(new DOMParser().parseFromString(text, 'text/html')) === "
                         "ids(document); })()") == true);
  browser.Evaluate(
      "form.elements.q.value = 'cell-12'; form.elements.q.dispatchEvent(new "
      "Event('input'))");
  CHECK(browser.Evaluate("document.querySelectorAll('.card:not([hidden])').length") == 1);
  scene.Run(
      "INSERT INTO cell (line, node, birth, last_received, state, health) VALUES "
      "('line 9', 'cell-12b', 1, now() + interval '1 hour', '{}', 0)");
  CHECK(browser.Becomes("document.querySelectorAll('.card:not([hidden])').length === 2"));
  browser.Evaluate("form.elements.lines.click()");
  CHECK(
      browser.Becomes("document.querySelector('[data-list=\"line line 9\"]') !== null && "
                      "document.querySelectorAll('.card:not([hidden])').length === 2"));
  scene.page.reset();
  CHECK(browser.Becomes("document.getElementById('headline').textContent === 'LOST'"));
}

TEST_CASE("without scripts the page is the same") {
  if (!CanBrowsePlant()) return;
  PlantPageScene scene(300);
  MakeTrouble(scene);
  REQUIRE(Soon([&] { return scene.Get("/").body.find("6 cells need") != std::string::npos; }));
  Browser browser(1280, 800, false, false);
  browser.Call("Emulation.setScriptExecutionDisabled", {{"value", true}});
  browser.Open(scene.Address() + "?q=line&lines=1");
  REQUIRE(browser.Becomes("document.querySelectorAll('section').length === 12"));
  CHECK(browser.Evaluate("document.querySelectorAll('.card').length") == 300);
}

}  // namespace plumbline::plant_page_browser_test
