#include "app/display/page/metrics.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "app/display/page/camera_facts.h"
#include "app/display/view/status_text.h"
#include "app/version.h"
#include "drivers/plc/register_map.h"

namespace plumbline::display {
namespace {

using Type = MetricsWriter::Type;

std::string EscapedLabel(std::string_view text) {
  std::string escaped;
  for (const char c : text) {
    if (c == '\\' || c == '"') escaped += '\\';
    if (c == '\n') {
      escaped += "\\n";
    } else {
      escaped += c;
    }
  }
  return escaped;
}

std::string NumberText(double value) {
  if (std::isnan(value)) return "NaN";
  if (std::isinf(value)) return value > 0 ? "+Inf" : "-Inf";
  return fmt::format("{}", value);
}

/// One sample per bit, 0 or 1, labelled with its meaning.
void AddWord(MetricsWriter& writer, std::string_view name, std::string_view help,
             std::string_view label, std::uint16_t word, std::span<const plc::BitMeaning> bits) {
  writer.Begin(name, Type::kGauge, help);
  for (const plc::BitMeaning& bit : bits) {
    writer.Add((word & bit.mask) != 0 ? 1 : 0, {{label, bit.meaning}});
  }
}

void AddHealth(MetricsWriter& writer, const CellHealth& health) {
  writer.Begin("health", Type::kGauge,
               "Health of the cell: 0 good, 1 notice, 2 attention, 3 alarm: do not assemble.");
  writer.Add(static_cast<double>(health.severity), {{"reason", Describe(health.reason)}});
}

void AddPoints(MetricsWriter& writer, const display::DisplayStatus& now) {
  const auto labels = [&](const cell::ViewPoint& point) {
    const auto name = now.point_names.find(point.id);
    return MetricsWriter::Labels{
        {"point", std::to_string(point.id)},
        {"name", name == now.point_names.end() ? std::string() : name->second}};
  };
  const std::vector<cell::ViewPoint>& points = now.state->points;
  writer.Begin("point_valid", Type::kGauge, "Whether the point has a valid correction.");
  for (const cell::ViewPoint& point : points) writer.Add(point.valid ? 1 : 0, labels(point));
  writer.Begin("point_correction_meters", Type::kGauge,
               "Size of the correction: command position minus target position.");
  for (const cell::ViewPoint& point : points) {
    if (point.valid) writer.Add(point.translation_B.norm(), labels(point));
  }
  writer.Begin("point_uncertainty_meters", Type::kGauge,
               "95 % radius of the attained position; its basis is a label.");
  for (const cell::ViewPoint& point : points) {
    if (!point.valid || point.uncertainty_m <= 0) continue;
    MetricsWriter::Labels with_basis = labels(point);
    with_basis.push_back({"basis", Describe(point.basis)});
    writer.Add(point.uncertainty_m, with_basis);
  }
}

void AddCameras(MetricsWriter& writer, const display::DisplayStatus& now, double now_s) {
  const std::vector<CameraFacts> cameras = CamerasOf(now);
  if (cameras.empty()) return;
  writer.Begin("lens_valid", Type::kGauge, "Whether the lens is verified at the present zoom.");
  for (const CameraFacts& facts : cameras) {
    writer.Add(facts.camera->status.state == lens::ZoomState::kValid ? 1 : 0,
               {{"camera", facts.name}});
  }
  writer.Begin("lens_usable_radius_pixels", Type::kGauge,
               "Distance from the middle of the image up to which the lens is trusted; +Inf: "
               "everywhere.");
  for (const CameraFacts& facts : cameras) {
    if (!facts.camera->lens) continue;
    writer.Add(facts.camera->usable_radius_px.value_or(std::numeric_limits<double>::infinity()),
               {{"camera", facts.name}});
  }
  writer.Begin("camera_image_age_seconds", Type::kGauge, "Age of the newest image.");
  for (const CameraFacts& facts : cameras) {
    if (!facts.camera->image) continue;
    writer.Add(std::max(0.0, now_s - facts.camera->image->time_s), {{"camera", facts.name}});
  }
  writer.Begin("camera_image_rate_hertz", Type::kGauge, "Received frame rate.");
  for (const CameraFacts& facts : cameras) {
    writer.Add(facts.images_per_s, {{"camera", facts.name}});
  }
  writer.Begin("tags_seen", Type::kGauge, "Number of tags in the newest image.");
  for (const CameraFacts& facts : cameras) {
    writer.Add(static_cast<double>(facts.camera->tags.size()), {{"camera", facts.name}});
  }
}

void AddPairs(MetricsWriter& writer, const display::DisplayStatus& now) {
  if (now.pairs.empty()) return;
  const auto labels = [](const cell::MeasuredPair& pair) {
    return MetricsWriter::Labels{{"a", pair.a}, {"b", pair.b}};
  };
  writer.Begin("interference", Type::kGauge, "Whether two virtual objects interfere.");
  for (const cell::MeasuredPair& pair : now.pairs) {
    if (pair.separation) writer.Add(pair.separation->touching ? 1 : 0, labels(pair));
  }
  writer.Begin("distance_meters", Type::kGauge,
               "Distance between two virtual objects; 0 if they interfere.");
  for (const cell::MeasuredPair& pair : now.pairs) {
    if (!pair.separation) continue;
    writer.Add(pair.separation->touching ? 0 : pair.separation->distance_m, labels(pair));
  }
}

void AddMonitoring(MetricsWriter& writer, const cell::ViewState& state) {
  const status::MonitoringStatus& monitoring = state.monitoring;
  writer.Gauge("model_version", "Version of the model in force; 0: the cell file.",
               state.model_version);
  writer.Gauge("model_proposed_version", "Model version that awaits approval; 0: none.",
               monitoring.model.proposed);
  if (!monitoring.recording) return;
  writer.Begin("probes_total", Type::kCounter, "Probes since the daemon started.");
  writer.Add(monitoring.probes);
  writer.Gauge("drift_ratio", "Statistic of the drift monitor; it alarms above 1.",
               monitoring.drift_statistic);
  writer.Gauge("diagnosis_running", "Whether a diagnosis is running.",
               monitoring.diagnosing ? 1 : 0);
  if (monitoring.probes == 0) return;
  writer.Begin("residual_meters", Type::kGauge,
               "Residual of the last probe: measured minus predicted, in the measurement frame.");
  constexpr std::array kAxes = {"x", "y", "z"};
  for (std::size_t k = 0; k < kAxes.size(); ++k) {
    writer.Add(monitoring.residual_m[static_cast<Eigen::Index>(k)], {{"axis", kAxes[k]}});
  }
}

/// The format requires cumulative buckets.
void AddLateness(MetricsWriter& writer, const LatenessHistogram& starts) {
  writer.Begin("cycle_start_late_seconds", Type::kHistogram,
               "Lateness of control cycle starts since the daemon started.");
  std::uint64_t sum = 0;
  for (std::size_t k = 0; k < starts.counts.size(); ++k) {
    sum += starts.counts[k];
    const bool last = k == LatenessHistogram::kBounds_s.size();
    writer.Add(static_cast<double>(sum),
               {{"le", last ? "+Inf" : NumberText(LatenessHistogram::kBounds_s[k])}}, "_bucket");
  }
  writer.Add(starts.sum_s, {}, "_sum");
  writer.Add(static_cast<double>(sum), {}, "_count");
}

void AddState(MetricsWriter& writer, const display::DisplayStatus& now, double now_s) {
  const cell::ViewState& state = *now.state;
  writer.Begin("daemon_info", Type::kGauge, "Version and cell of the daemon; always 1.");
  writer.Add(1, {{"version", state.version}, {"cell", state.cell}});
  writer.Gauge("daemon_uptime_seconds", "Time since the daemon started.", state.cycle.uptime_s);
  writer.Begin("cycles_total", Type::kCounter, "Machine cycles since the daemon started.");
  writer.Add(static_cast<double>(state.cycle.cycles));
  writer.Begin("late_cycles_total", Type::kCounter,
               "Machine cycles that started late since the daemon started.");
  writer.Add(static_cast<double>(state.cycle.late));
  writer.Gauge("longest_cycle_seconds",
               "Longest computation of a control cycle since the daemon started.",
               state.cycle.longest_s);
  AddLateness(writer, state.cycle.starts);
  AddWord(writer, "alarm", "Alarms, each 1 while it is active.", "alarm", state.alarms,
          plc::registers::AlarmBits());
  AddWord(writer, "warning", "Warnings, each 1 while it is active.", "warning", state.warnings,
          plc::registers::WarningBits());
  if ((state.alarms & alarm::kRobotMissing) == 0) {
    writer.Gauge("robot_data_age_seconds", "Age of the robot reading.", state.data_age_s);
  }
  if (state.payload_kg) writer.Gauge("payload_kilograms", "Payload in force.", *state.payload_kg);
  if (state.temp_C) {
    writer.Gauge("temperature_celsius", "Temperature reported by the robot.", *state.temp_C);
  }
  AddHealth(writer, now.health);
  AddPoints(writer, now);
  AddMonitoring(writer, state);
  AddCameras(writer, now, now_s);
  AddPairs(writer, now);
}

}  // namespace

void MetricsWriter::Begin(std::string_view name, Type type, std::string_view help) {
  name_ = fmt::format("plumbline_{}", name);
  text_ += fmt::format("# HELP {0} {1}\n# TYPE {0} {2}\n", name_, help,
                       type == Type::kCounter     ? "counter"
                       : type == Type::kHistogram ? "histogram"
                                                  : "gauge");
}

void MetricsWriter::Add(double value, const Labels& labels, std::string_view suffix) {
  text_ += name_;
  text_ += suffix;
  const char* before = "{";
  for (const auto& [label, word] : labels) {
    text_ += fmt::format("{}{}=\"{}\"", before, label, EscapedLabel(word));
    before = ",";
  }
  text_ += fmt::format("{} {}\n", labels.empty() ? "" : "}", NumberText(value));
}

void MetricsWriter::Gauge(std::string_view name, std::string_view help, double value) {
  Begin(name, Type::kGauge, help);
  Add(value);
}

bool DaemonReports(const display::DisplayStatus* now, double now_s) {
  return now != nullptr && now->state &&
         !display::DaemonIsSilent(*now->state, now->link_problem, now_s);
}

std::string MetricsText(const display::DisplayStatus* now, const PageCounts& page, double now_s) {
  MetricsWriter writer;
  const bool up = DaemonReports(now, now_s);
  writer.Gauge("up", "Whether plumblined reports its state.", up ? 1 : 0);
  writer.Begin("view_info", Type::kGauge,
               "Version of plumbline-view, which exports these metrics; always 1.");
  writer.Add(1, {{"version", PLUMBLINE_VERSION}});
  writer.Begin("page_requests_total", Type::kCounter, "Requests to the page.");
  writer.Add(static_cast<double>(page.requests));
  writer.Begin(
      "page_refused_total", Type::kCounter,
      "Refused requests: missing token, wrong host, method or path, no picture, or a limit; "
      "including rejected connections.");
  writer.Add(static_cast<double>(page.refused));
  writer.Gauge("page_connections", "Open connections to the page.", page.connections);
  writer.Gauge("page_viewers", "Open connections to the live picture.", page.viewers);
  if (up) AddState(writer, *now, now_s);
  return writer.Take();
}

}  // namespace plumbline::display
