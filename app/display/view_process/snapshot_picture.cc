#include "app/display/view_process/snapshot_picture.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <iostream>
#include <mutex>

#include "app/base/terminal/terminal_output.h"
#include "app/base/text/json_text.h"
#include "app/display/view/panels.h"
#include "app/display/view/screen_text.h"
#include "app/display/view/state_strip.h"
#include "app/display/view_process/await_state.h"
#include "app/display/view_process/drawing.h"
#include "app/display/view_process/png_file.h"
#include "app/display/view_process/viewer.h"
#include "drivers/clock.h"

namespace plumbline::display {
namespace {

constexpr int kFault = 1, kUsage = 2;

/// Guards standard output and error: the scene worker's thread prints, too, and every insertion
/// into std::cerr flushes std::cout.
std::mutex printing;

int Refuse(int code, const std::string& why) {
  const std::lock_guard lock(printing);
  std::cerr << "plumbline snapshot: " << why << '\n';
  return code;
}

nlohmann::json PanelsJson(const std::vector<display::Panel>& panels) {
  nlohmann::json json = nlohmann::json::object();
  for (const display::Panel& panel : panels) {
    for (const display::PanelLine& line : panel.lines) json[panel.title].push_back(line.text);
  }
  return json;
}

void Print(const SnapshotOptions& options, const display::ViewFacts& facts) {
  if (!options.json) {
    std::cout << fmt::format("{}: {}x{}, {}\n", options.out, options.size.width,
                             options.size.height, Headline(facts).text);
    return;
  }
  const cell::ViewState& state = *facts.state;
  nlohmann::json json = {{"schema", 1},
                         {"file", options.out},
                         {"width_px", options.size.width},
                         {"height_px", options.size.height},
                         {"cell", state.cell},
                         {"utc_s", state.utc_s},
                         {"model_version", state.model_version},
                         {"alarms", state.alarms},
                         {"warnings", state.warnings},
                         {"headline", Headline(facts).text},
                         {"stale_because", display::StaleReasons(facts)},
                         {"panels", PanelsJson(display::PanelsOf(facts))}};
  json["cameras"] = nlohmann::json::array();
  for (const std::size_t k : facts.shown) {
    const cell::ViewCamera& camera = cell::CameraOf(state, k);
    json["cameras"].push_back(
        {{"name", status::CameraNameText(camera.status.name)},
         {"image_age_s", camera.image ? nlohmann::json(facts.now_s - camera.image->time_s)
                                      : nlohmann::json(nullptr)}});
  }
  std::cout << text::JsonText(json, 1) << '\n';
}

}  // namespace

int TakeSnapshot(const SnapshotOptions& options) {
  const terminal::TerminalOutput out(std::cout, STDOUT_FILENO), err(std::cerr, STDERR_FILENO);
  std::cerr << terminal::ForReading;
  config::FaultList faults;
  std::optional<cell::ViewModel> model = cell::ReadViewModel(options.config_file, 0, faults);
  if (!model) {
    std::cerr << config::FaultsText(faults);
    return kFault;
  }
  config::OverlayConfig& overlay = model->config.overlay;
  if (!options.camera.empty()) {
    overlay.camera.reset();
    std::string names = "both";
    for (const config::CameraConfig& one : model->config.vision.cameras) {
      if (options.camera == status::CameraNameText(one.name)) overlay.camera = one.name;
      if (one.name != status::CameraName::kNone)
        names += fmt::format(", {}", status::CameraNameText(one.name));
    }
    if (!overlay.camera && options.camera != "both") {
      return Refuse(
          kUsage, fmt::format("--camera {}: no such camera; known are: {}", options.camera, names));
    }
  }
  Drawing drawing([](const log::LogEntry&) {});
  if (!drawing.Ready(MonotonicSeconds())) return Refuse(kUsage, drawing.problem());

  Viewer viewer(options.config_file, std::move(*model), [](const log::LogEntry& entry) {
    // A missing connection is reported at the end, if it is not established in time.
    const bool bad = log::EntryOf(entry.event).level <= log::LogLevel::kWarning;
    if (!bad || entry.event == log::Event::kViewLinkLost) return;
    const std::lock_guard lock(printing);
    std::cerr << entry.text << '\n';
  });
  if (!AwaitState(viewer, options.state_wait_s)) {
    return Refuse(kUsage, viewer.Facts().link_problem + "; " +
                              display::MessageOf({HealthSeverity::kAlarm, HealthReason::kNoDaemon},
                                                 viewer.Facts())
                                  .remedy);
  }
  AwaitMeasured(viewer, options.meshes_wait_s);
  const display::ViewFacts& facts = viewer.Facts();
  const std::vector<int>& meshes = drawing.Meshes(viewer.scene());
  const display::OverlayInput input{facts, viewer.config(), meshes, viewer.Pixels(),
                                    viewer.MeshFacts()};
  if (!drawing.Draw(display::PictureOf(input, display::LayoutFor(facts, options.size),
                                       drawing.text_width()))) {
    return Refuse(kUsage, "drawing failed: " + drawing.renderer().problem());
  }
  const auto written = WritePng(options.out, drawing.renderer().ReadBack());
  if (!written) return Refuse(kUsage, written.error());
  const std::lock_guard lock(printing);
  Print(options, facts);
  std::cout.flush();
  return std::cout.good() ? 0 : kUsage;
}

}  // namespace plumbline::display
