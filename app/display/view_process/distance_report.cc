#include "app/display/view_process/distance_report.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <iostream>
#include <set>

#include "app/base/terminal/terminal_output.h"
#include "app/base/text/json_text.h"
#include "app/display/view/state_strip.h"
#include "app/display/view_process/await_state.h"

namespace plumbline::display {
namespace {

constexpr int kIncomplete = 1, kNoAnswer = 2;

int RefuseDistance(int code, const std::string& why) {
  std::cerr << "plumbline distance: " << why << '\n';
  return code;
}

nlohmann::json XyzJson(const Vec3& p_W) {
  return {1e3 * p_W.x(), 1e3 * p_W.y(), 1e3 * p_W.z()};
}

std::string XyzText(const Vec3& p_W) {
  return fmt::format("({:.2f}, {:.2f}, {:.2f})", 1e3 * p_W.x(), 1e3 * p_W.y(), 1e3 * p_W.z());
}

const char* StateName(const cell::MeasuredPair& pair) {
  if (!pair.separation) return "not measured";
  return pair.separation->touching                ? "interference"
         : pair.state == scene::Proximity::kApart ? "apart"
                                                  : "near";
}

/// Builds the text and the JSON form of the report side by side.
class DistanceReport {
 public:
  void Add(const cell::MeasuredDistance& one) {
    nlohmann::json json = {{"name", one.name}, {"distance_mm", nullptr}};
    if (one.distance_m) {
      json["distance_mm"] = 1e3 * *one.distance_m;
      json["from_W_mm"] = XyzJson(one.p_a_W);
      json["to_W_mm"] = XyzJson(one.p_b_W);
      Line(one.name, fmt::format("{:.2f} mm", 1e3 * *one.distance_m));
    } else {
      Missing(one.name);
    }
    json_["distances"].push_back(json);
  }
  void Add(const cell::PlacedPoint& one) {
    json_["points"].push_back(
        {{"name", one.name}, {"xyz_W_mm", one.p_W ? XyzJson(*one.p_W) : nlohmann::json()}});
    one.p_W ? Line(one.name, "at " + XyzText(*one.p_W) + " mm") : Missing(one.name);
  }
  void Add(const cell::MeasuredPair& one) {
    const std::string name = one.a + " / " + one.b;
    nlohmann::json json = {{"objects", {one.a, one.b}}, {"state", StateName(one)}};
    json["distance_mm"] = json["depth_mm"] = nullptr;
    if (!one.separation) {
      Missing(name);
    } else if (one.separation->touching) {
      json["distance_mm"] = 0;
      json["depth_mm"] = 1e3 * one.separation->depth_m;
      Line(name, fmt::format("interference, {:.2f} mm deep", 1e3 * one.separation->depth_m));
    } else {
      json["distance_mm"] = 1e3 * one.separation->distance_m;
      Line(name, fmt::format("{:.2f} mm", 1e3 * one.separation->distance_m));
    }
    json_["pairs"].push_back(json);
  }
  bool complete() const { return complete_; }
  const std::string& text() const { return text_; }
  nlohmann::json json() const { return json_; }

 private:
  void Line(const std::string& name, const std::string& what) {
    text_ += fmt::format("{}: {}\n", name, what);
  }
  void Missing(const std::string& name) {
    complete_ = false;
    Line(name, "not measured: its carrier has no current pose, or its mesh is not loaded");
  }

  bool complete_ = true;
  std::string text_;
  nlohmann::json json_ = {{"schema", 1},
                          {"distances", nlohmann::json::array()},
                          {"pairs", nlohmann::json::array()},
                          {"points", nlohmann::json::array()}};
};

}  // namespace

int PrintDistances(const DistanceOptions& options) {
  const terminal::TerminalOutput out(std::cout, STDOUT_FILENO), err(std::cerr, STDERR_FILENO);
  std::cerr << terminal::ForReading;
  config::FaultList faults;
  std::optional<cell::ViewModel> model = cell::ReadViewModel(options.config_file, 0, faults);
  if (!model) {
    std::cerr << config::FaultsText(faults);
    return kIncomplete;
  }
  if (model->config.overlay.objects_file.empty()) {
    return RefuseDistance(kIncomplete,
                          options.config_file + ": no object table; set objects under [overlay]");
  }
  Viewer viewer(options.config_file, std::move(*model), [](const log::LogEntry&) {});
  if (!AwaitState(viewer, options.state_wait_s)) {
    return RefuseDistance(
        kNoAnswer,
        viewer.Facts().link_problem + "; " +
            display::MessageOf({HealthSeverity::kAlarm, HealthReason::kNoDaemon}, viewer.Facts())
                .remedy);
  }
  AwaitMeasured(viewer, options.meshes_wait_s);
  const display::ViewFacts& facts = viewer.Facts();
  if (facts.table == nullptr || facts.measured == nullptr) {
    std::string why = "the object table has not been read";
    for (const display::PanelLine& line : facts.objects) why += "\n  " + line.text;
    return RefuseDistance(kIncomplete, why);
  }
  const cell::SceneMeasurements& measured = *facts.measured;
  if (facts.now_s - measured.time_s > cell::kMeasuredFresh_s) {
    return RefuseDistance(kNoAnswer,
                          "the measurements are outdated: no data arrives from plumblined");
  }
  std::set<std::string> left(options.names.begin(), options.names.end()), known;
  const auto wanted = [&](const std::string& name) {
    known.insert(name);
    return options.names.empty() || left.contains(name);
  };
  DistanceReport report;
  for (const cell::MeasuredDistance& one : measured.distances) {
    if (wanted(one.name)) report.Add(one);
  }
  for (const cell::MeasuredPair& one : measured.pairs) {
    const bool a = wanted(one.a), b = wanted(one.b);
    if (a || b) report.Add(one);
  }
  for (const cell::PlacedPoint& one : measured.points) {
    if (wanted(one.name)) report.Add(one);
  }
  for (const std::string& name : left) {
    if (known.contains(name)) continue;
    std::string names;
    for (const std::string& other : known) names += (names.empty() ? "" : ", ") + other;
    return RefuseDistance(kIncomplete,
                          fmt::format("\"{}\" is not in the object table; known are: {}", name,
                                      names.empty() ? "none" : names));
  }
  nlohmann::json json = report.json();
  json["cell"] = facts.state->cell;
  json["utc_s"] = facts.state->utc_s;
  json["model_version"] = facts.state->model_version;
  std::cout << (options.json ? text::JsonText(json, 1) + "\n" : report.text());
  std::cout.flush();
  if (!std::cout.good()) return kNoAnswer;
  return report.complete() ? 0 : kIncomplete;
}

}  // namespace plumbline::display
