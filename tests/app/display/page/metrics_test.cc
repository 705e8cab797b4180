#include "app/display/page/metrics.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>

#include "tests/app/display/page/exposition.h"
#include "tests/app/display/page/page_scene.h"

namespace plumbline::metrics_test {

using namespace plumbline::display;
using namespace plumbline::test;

TEST_CASE("the format checker finds malformed texts") {
  CHECK(Exposition("# HELP a b\n# TYPE a gauge\na 1\n").problem.empty());
  CHECK(Exposition("# HELP a b\n# TYPE a gauge\na{x=\"\\\\ \\\" \\n\",y=\"\"} -1.5e-07\n")
            .problem.empty());
  for (const char* const wrong :
       {"", "a 1", "# HELP a b\n# TYPE a gauge\na 1", "a 1\n", "# TYPE a gauge\na 1\n",
        "# HELP a b\n# TYPE a counter\na 1\n", "# HELP a b\n# TYPE a gauge\na_sum 1\n",
        "# HELP a b\n# TYPE a histogram\na_min 1\n",
        "# HELP a_total b\n# TYPE a_total gauge\na_total 1\n", "# HELP a b\n# TYPE a gauge\nb 1\n",
        "# HELP a b\n# TYPE a gauge\na 1\na 2\n", "# HELP a b\n# TYPE a gauge\na{x=\"\"\"} 1\n",
        "# HELP a b\n# TYPE a gauge\na{x=\"\\x\"} 1\n", "# HELP a b\n# TYPE a gauge\na inf\n",
        "# HELP a b\n# TYPE a gauge\na{1=\"\"} 1\n", "# HELP a b\n# TYPE a gauge\na  1\n",
        "# HELP a b\n# TYPE a gauge\n\na 1\n",
        "# HELP a b\n# TYPE a gauge\na 1\n# HELP a b\n# TYPE a gauge\n"}) {
    INFO(wrong);
    CHECK_FALSE(Exposition(wrong).problem.empty());
  }
}

TEST_CASE("labels are escaped, and non-finite numbers formatted") {
  MetricsWriter writer;
  writer.Begin("a", MetricsWriter::Type::kGauge, "Help.");
  writer.Add(0.1, {{"name", "quote \" backslash \\ line\nend"}});
  writer.Add(std::numeric_limits<double>::infinity(), {{"name", "inf"}});
  writer.Add(std::nan(""), {{"name", "nan"}});
  writer.Add(-1e-9, {{"name", "\xc3\xa4"}});
  const std::string text = writer.Take();
  const Exposition read(text);
  INFO(text);
  CHECK(read.problem.empty());
  CHECK(read.samples.at("plumbline_a{name=\"quote \\\" backslash \\\\ line\\nend\"}") == "0.1");
  CHECK(read.samples.at("plumbline_a{name=\"inf\"}") == "+Inf");
  CHECK(read.samples.at("plumbline_a{name=\"nan\"}") == "NaN");
}

TEST_CASE("every metric and label of the Grafana dashboards is exported") {
  const char* const dashboard = GENERATE("packaging/examples/grafana/plumbline.json",
                                         "config/plant/grafana/plant-prometheus.json");
  CAPTURE(dashboard);
  PageScene scene;
  scene.scene.state.monitoring.recording = true;
  scene.scene.state.monitoring.probes = 12;
  scene.scene.state.temp_C = 21.5;
  scene.PublishStatus();
  auto now = std::make_shared<display::DisplayStatus>(*scene.shown.status());
  cell::MeasuredPair pair;
  pair.a = "fixture";
  pair.b = "part";
  pair.separation = cell::Separation{};
  now->pairs = {pair};
  const std::string metrics = MetricsText(now.get(), {7, 2, 1, 0}, MonotonicSeconds());
  const Exposition read(metrics);
  std::ifstream file(dashboard);
  const nlohmann::json board = nlohmann::json::parse(file);
  int targets = 0;
  const auto check = [&](const std::string& expression, const std::string& legend) {
    CAPTURE(expression, legend);
    static const std::regex name("plumbline_[a-z_]+"), label("\\{\\{([a-z]+)\\}\\}");
    const std::sregex_iterator none;
    std::string of_names;
    for (std::sregex_iterator at(expression.begin(), expression.end(), name); at != none; ++at) {
      std::string metric = at->str();
      if (metric.ends_with("_bucket")) metric.erase(metric.size() - 7);
      CHECK(read.types.contains(metric));
      of_names = metric;
      ++targets;
    }
    for (std::sregex_iterator at(legend.begin(), legend.end(), label); at != none; ++at) {
      const std::string word = (*at)[1];
      const bool known =
          word == "instance" ||
          std::any_of(read.samples.begin(), read.samples.end(), [&](const auto& sample) {
            return sample.first.starts_with(of_names) &&
                   sample.first.find(word + "=\"") != std::string::npos;
          });
      CHECK(known);
    }
  };
  std::set<int> ids;
  for (const nlohmann::json& panel : board.at("panels")) {
    CHECK(ids.insert(panel.at("id").get<int>()).second);
    for (const nlohmann::json& target : panel.at("targets"))
      check(target.at("expr"), target.at("legendFormat"));
  }
  for (const nlohmann::json& note : board.at("annotations").at("list"))
    check(note.at("expr"), note.at("titleFormat"));
  CHECK(targets >= 15);
}

TEST_CASE("metrics of a cell without faults") {
  PageScene scene;
  scene.scene.state.cycle = {3600, 0.0007, 360000, 2, {{359900, 98}, 4.5}};
  scene.scene.state.cycle.starts.counts.back() = 2;
  scene.scene.state.monitoring.recording = true;
  scene.scene.state.monitoring.probes = 12;
  scene.scene.state.monitoring.residual_m = Vec3(1e-4, -2e-4, 3e-4);
  scene.scene.state.temp_C = 21.5;
  scene.PublishStatus();
  auto now = std::make_shared<display::DisplayStatus>(*scene.shown.status());
  cell::MeasuredPair pair;
  pair.a = "fixture";
  pair.b = "part";
  pair.separation = cell::Separation{};
  pair.separation->distance_m = 0.012;
  now->pairs = {pair};
  const std::string text = MetricsText(now.get(), {7, 2, 1, 0}, MonotonicSeconds());
  const Exposition read(text);
  INFO(text);
  REQUIRE(read.problem.empty());
  CHECK(read.Value("plumbline_up") == 1);
  CHECK(read.Value("plumbline_daemon_info{version=\"0.1.0\",cell=\"demo cell\"}") == 1);
  CHECK(read.types.at("plumbline_cycles_total") == "counter");
  CHECK(read.Value("plumbline_cycles_total") == 360000);
  CHECK(read.Value("plumbline_late_cycles_total") == 2);
  CHECK(read.Value("plumbline_longest_cycle_seconds") == Approx(0.0007));
  CHECK(read.types.at("plumbline_cycle_start_late_seconds") == "histogram");
  CHECK(read.Value("plumbline_cycle_start_late_seconds_bucket{le=\"2e-05\"}") == 359900);
  CHECK(read.Value("plumbline_cycle_start_late_seconds_bucket{le=\"0.1\"}") == 359998);
  CHECK(read.Value("plumbline_cycle_start_late_seconds_bucket{le=\"+Inf\"}") == 360000);
  CHECK(read.Value("plumbline_cycle_start_late_seconds_count") == 360000);
  CHECK(read.Value("plumbline_cycle_start_late_seconds_sum") == 4.5);
  CHECK(read.Value("plumbline_alarm{alarm=\"payload unknown\"}") == 0);
  CHECK(read.Value("plumbline_payload_kilograms") == 40);
  CHECK(read.Value("plumbline_temperature_celsius") == 21.5);
  CHECK(read.Value("plumbline_probes_total") == 12);
  CHECK(read.Value("plumbline_residual_meters{axis=\"y\"}") == Approx(-2e-4));
  CHECK(read.Value("plumbline_lens_valid{camera=\"camera\"}") == 1);
  CHECK(std::isinf(read.Value("plumbline_lens_usable_radius_pixels{camera=\"camera\"}")));
  CHECK(read.Value("plumbline_tags_seen{camera=\"camera\"}") == 3);
  CHECK(read.Value("plumbline_distance_meters{a=\"fixture\",b=\"part\"}") == 0.012);
  CHECK(read.Value("plumbline_interference{a=\"fixture\",b=\"part\"}") == 0);
  CHECK(read.Value("plumbline_page_requests_total") == 7);
  const cell::ViewPoint& point = scene.scene.state.points.front();
  const std::string labels =
      "{point=\"" + std::to_string(point.id) + "\",name=\"" + now->point_names.at(point.id) + "\"}";
  CHECK(read.Value("plumbline_point_valid" + labels) == 1);
  CHECK(read.Value("plumbline_point_correction_meters" + labels) ==
        Approx(point.translation_B.norm()));
  const std::string with_basis = labels.substr(0, labels.size() - 1) + ",basis=\"measured\"}";
  CHECK(read.Value("plumbline_point_uncertainty_meters" + with_basis) == Approx(0.0003));
  CHECK(read.Value("plumbline_health{reason=\"\"}") == 0);
}

TEST_CASE("without a current state no values are exported") {
  PageScene scene;
  scene.PublishStatus(10);
  for (const display::DisplayStatus* now :
       {scene.shown.status().get(), static_cast<const display::DisplayStatus*>(nullptr)}) {
    const std::string text = MetricsText(now, {}, MonotonicSeconds());
    const Exposition read(text);
    CHECK(read.problem.empty());
    CHECK(read.Value("plumbline_up") == 0);
    CHECK_FALSE(read.types.contains("plumbline_payload_kilograms"));
    CHECK_FALSE(read.types.contains("plumbline_alarm"));
  }
}

TEST_CASE("active alarms are 1; a point without a valid correction has no values") {
  PageScene scene;
  scene.scene.state.alarms = alarm::kRobotMissing | alarm::kPointRefused;
  scene.scene.state.points.front().valid = false;
  scene.scene.state.payload_kg.reset();
  scene.PublishStatus();
  const auto now = scene.shown.status();
  const Exposition read(MetricsText(now.get(), {}, MonotonicSeconds()));
  CHECK(read.problem.empty());
  CHECK(read.Value("plumbline_alarm{alarm=\"nothing read from the robot\"}") == 1);
  CHECK_FALSE(read.types.contains("plumbline_robot_data_age_seconds"));
  CHECK_FALSE(read.types.contains("plumbline_payload_kilograms"));
  const cell::ViewPoint& point = scene.scene.state.points.front();
  const std::string labels =
      "{point=\"" + std::to_string(point.id) + "\",name=\"" + now->point_names.at(point.id) + "\"}";
  CHECK(read.Value("plumbline_point_valid" + labels) == 0);
  CHECK_FALSE(read.samples.contains("plumbline_point_correction_meters" + labels));
}

}  // namespace plumbline::metrics_test
