// Fixture: a page that shows the demo cell and single-coloured pictures.
#pragma once

#include <fstream>
#include <thread>

#include "app/display/page/page.h"
#include "drivers/clock.h"
#include "drivers/os/descriptor.h"
#include "firmware-like/image/image_size.h"
#include "tests/app/display/page/page_client.h"
#include "tests/app/display/view/view_scene.h"

namespace plumbline::test {

/// Waits up to 20 s, long enough for a loaded machine.
template <typename Condition>
bool HoldsSoon(Condition holds) {
  for (int tries = 0; tries < 2000; ++tries) {
    if (holds()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return false;
}

struct PageScene {
  ViewScene scene;
  display::DisplayMailbox shown;
  std::vector<std::string> logged;
  std::mutex log_mutex;
  std::unique_ptr<display::Page> page;

  PageScene() { std::filesystem::create_directories(StateDirectory()); }

  std::string StateDirectory() const { return scene.folder.path() + "/state"; }
  void Write(const std::string& name, const std::string& text) const {
    const std::filesystem::path file = StateDirectory() + "/" + name;
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file) << text;
  }

  display::PageOptions Options() const {
    display::PageOptions options;
    options.config.port = 0;
    options.state_directory = StateDirectory();
    options.joints = scene.model->config.machine.cell.robot.joints;
    return options;
  }
  void Start(display::PageOptions options, os::Descriptor listener = {}) {
    const auto log = [this](const log::LogEntry& entry) {
      const std::lock_guard lock(log_mutex);
      logged.push_back(entry.text);
    };
    auto started = display::Page::Start(std::move(options), shown, log, std::move(listener));
    INFO((started ? std::string() : started.error()));
    REQUIRE(started);
    page = std::move(started).value();
  }
  void StartWithToken(const std::string& token) {
    display::PageOptions options = Options();
    options.config.token = token;
    Start(options);
  }
  int port() const { return page->at().port; }
  PageResponse Get(const std::string& path, const std::string& headers = "") const {
    return Request(port(), path, headers);
  }

  /// Publishes a status as the viewer does five times a second. @param age_s  of the state
  void PublishStatus(double age_s = 0, const std::string& link_problem = "") {
    const double now_s = MonotonicSeconds();
    scene.state.now_s = now_s - age_s;
    for (cell::ViewCamera& camera : scene.state.cameras) {
      if (camera.image) camera.image->time_s = now_s - age_s - 0.03;
    }
    cell::Carriers carriers = scene.Placed(now_s - age_s);
    display::ViewFacts facts;
    facts.state = &scene.state;
    facts.carriers = std::span(&carriers, 1);
    facts.model = &*scene.model;
    facts.now_s = now_s;
    facts.link_problem = link_problem;
    facts.frames_per_s = {30};
    facts.viewer_lines = {{1, 1.8e9 - 90, 5, "plumbline-view 0.1.0"}};
    shown.Publish(
        std::make_shared<const display::DisplayStatus>(display::MakeDisplayStatus(facts, "")));
  }
  /// A picture of one colour.
  void PublishPicture(std::uint8_t red, std::uint8_t green, std::uint8_t blue, double age_s = 0,
                      image::ImageSize size = {320, 180}) {
    auto picture = std::make_shared<display::DisplayPicture>();
    picture->image.size = size;
    for (int k = 0; k < size.width * size.height; ++k) {
      picture->image.rgb.insert(picture->image.rgb.end(), {red, green, blue});
    }
    picture->time_s = MonotonicSeconds() - age_s;
    shown.Publish(std::shared_ptr<const display::DisplayPicture>(std::move(picture)));
  }
};

}  // namespace plumbline::test
