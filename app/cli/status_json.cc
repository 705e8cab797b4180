#include "app/cli/status_json.h"

#include <cstdint>
#include <string_view>

#include "app/cli/status_devices.h"
#include "drivers/plc/register_map.h"

namespace plumbline::cli {
namespace {

nlohmann::json JsonOf(plc::FieldType type, double value) {
  if (type == plc::FieldType::kFloat) return value;
  return static_cast<std::int64_t>(value);
}

nlohmann::json CameraJson(const DaemonRegisters& daemon, int camera) {
  nlohmann::json json = {{"name", daemon.CameraName(camera)}};
  for (const plc::MapField& field : plc::registers::CameraFields()) {
    json[field.name] = JsonOf(field.type, daemon.Camera(field.name, camera));
  }
  json["bodies_detail"] = nlohmann::json::array();
  for (int k = 0; k < static_cast<int>(daemon.Camera("bodies", camera)); ++k) {
    nlohmann::json body;
    for (const plc::MapField& field : plc::registers::BodyFields()) {
      body[field.name] = JsonOf(field.type, daemon.Body(field.name, camera, k));
    }
    json["bodies_detail"].push_back(body);
  }
  return json;
}

nlohmann::json GaugeJson(const DaemonRegisters& daemon, int gauge) {
  const bool any = daemon.HasGaugeReading(gauge);
  const auto state = static_cast<status::GaugeState>(daemon.Gauge("gauge_state", gauge));
  nlohmann::json json = {{"name", daemon.GaugeName(gauge)},
                         {"state", Describe(state)},
                         {"outcome", GaugeOutcomeText(daemon, gauge)}};
  for (const plc::MapField& field : plc::registers::GaugeFields()) {
    const std::string_view name = field.name;
    const bool of_reading = name == "gauge_reading" || name == "gauge_age";
    if (name.starts_with("gauge_name_") || (of_reading && !any)) continue;
    json[field.name] = JsonOf(field.type, daemon.Gauge(name, gauge));
  }
  return json;
}

nlohmann::json PointJson(const DaemonRegisters& daemon, int point) {
  nlohmann::json json;
  for (const plc::MapField& field : plc::registers::PointFields()) {
    json[field.name] = JsonOf(field.type, daemon.Value(field.name, point));
  }
  if (daemon.has_postures()) {
    for (const plc::MapField& field : plc::registers::PostureFields()) {
      json[field.name] = JsonOf(field.type, daemon.Posture(field.name, point));
    }
  }
  return json;
}

}  // namespace

nlohmann::json StatusJson(const DaemonRegisters& daemon) {
  nlohmann::json json;
  for (const plc::MapField& field : plc::registers::Fields()) {
    const bool result =
        field.address >= plc::registers::kResult && field.address < plc::registers::kInputs;
    if (!result) json[field.name] = JsonOf(field.type, daemon.Value(field.name));
  }
  json["cameras"] = nlohmann::json::array();
  for (int k = 0; k < daemon.cameras(); ++k) json["cameras"].push_back(CameraJson(daemon, k));
  for (const plc::MapField& field : plc::registers::SceneFields()) {
    json[field.name] = JsonOf(field.type, daemon.Scene(field.name));
  }
  json["gauges"] = nlohmann::json::array();
  for (int k = 0; k < daemon.gauges(); ++k) json["gauges"].push_back(GaugeJson(daemon, k));
  json["points_detail"] = nlohmann::json::array();
  for (int k = 0; k < daemon.points(); ++k) json["points_detail"].push_back(PointJson(daemon, k));
  return json;
}

}  // namespace plumbline::cli
