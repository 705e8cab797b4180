#include "app/plant/message_text.h"

#include <fmt/format.h>

#include <cmath>

#include "app/base/text/json_text.h"
#include "app/version.h"
#include "drivers/plc/register_map.h"
#include "firmware-like/geometry/angle.h"
#include "firmware-like/geometry/length.h"

namespace plumbline::plant {
namespace {

using Json = nlohmann::ordered_json;

std::string TextOf(const Json& json) {
  return text::JsonText(json);
}

/// Rounds to significant digits, to keep payloads short; null if not finite.
Json Rounded(double value, double step) {
  if (!std::isfinite(value)) return nullptr;
  const double per_unit = std::round(1 / step);
  return std::round(value * per_unit) / per_unit;
}

constexpr double kLengthStep_mm = 1e-4, kAngleStep_deg = 1e-4;

Json Millimetres(double metres) {
  return Rounded(metres * kMmPerMetre, kLengthStep_mm);
}

Json MillimetresOf(const Vec3& metres) {
  return {Millimetres(metres.x()), Millimetres(metres.y()), Millimetres(metres.z())};
}

Json OptionalNumber(const std::optional<double>& value, double step) {
  return value ? Rounded(*value, step) : Json(nullptr);
}

/// Degrees, or mm for prismatic joints; null if their number is not the cell's.
Json JointsJson(const model::JointVector& q, const std::vector<model::Joint>& joints) {
  if (q.size() == 0 || q.size() != static_cast<Eigen::Index>(joints.size())) return nullptr;
  Json list = Json::array();
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const double value = q[static_cast<Eigen::Index>(i)];
    list.push_back(joints[i].type == model::JointType::kPrismatic
                       ? Millimetres(value)
                       : Rounded(value * kDegPerRad, kAngleStep_deg));
  }
  return list;
}

Json LensFields(const status::CameraStatus& status) {
  return {{"camera", status::CameraNameText(status.name)},
          {"lens", std::string(lens::ZoomStateText(status.state))},
          {"reason", std::string(lens::ZoomReasonText(status.reason))},
          {"lens_id", status.lens_id}};
}

}  // namespace

std::string TopicOf(const FleetCell& cell, const char* type) {
  return fmt::format("{}/{}/{}/{}", kFleetNamespace, cell.group, type, cell.node);
}

std::string BirthText(const FleetCell& cell, const FleetQueue& queue, std::int64_t bdSeq,
                      std::int64_t utc_ms) {
  Json points = Json::array();
  for (const FleetCell::Point& point : cell.points) {
    points.push_back({{"id", point.id}, {"name", point.name}});
  }
  const FleetQueue::Dropped& dropped = queue.dropped();
  return TextOf(
      {{"timestamp", utc_ms},
       {"bdSeq", bdSeq},
       {"schema", kFleetSchema},
       {"version", PLUMBLINE_VERSION},
       {"cell", cell.cell},
       {"joints", cell.joints.size()},
       {"points", points},
       {"stream", queue.stream()},
       {"waiting", queue.size()},
       {"dropped", {{"states", dropped[0]}, {"changes", dropped[1]}, {"others", dropped[2]}}}});
}

std::string DeathText(std::int64_t bdSeq, std::int64_t utc_ms, bool clean_shutdown) {
  return TextOf({{"timestamp", utc_ms}, {"bdSeq", bdSeq}, {"clean_shutdown", clean_shutdown}});
}

std::string MessageText(const std::string& stream, const QueuedMessage& queued) {
  const std::string& body = queued.message.body;
  return fmt::format("{{\"stream\":\"{}\",\"seq\":{},\"timestamp\":{}{}{}", stream, queued.seq,
                     queued.message.utc_ms, body.size() > 2 ? "," : "", body.substr(1));
}

std::string StateBody(const cell::ViewState& state, const FleetCell& cell) {
  int valid = 0;
  for (const cell::ViewPoint& point : state.points) valid += point.valid;
  Json json = {{"status", state.status},
               {"alarms", state.alarms},
               {"warnings", state.warnings},
               {"health", static_cast<int>(state.health.severity)},
               {"health_reason", Describe(state.health.reason)},
               {"model", state.model_version},
               {"data_age_ms", Rounded(1e3 * state.data_age_s, 1)},
               {"q", JointsJson(state.q, cell.joints)},
               {"payload_kg", OptionalNumber(state.payload_kg, 1e-3)},
               {"temp_C", OptionalNumber(state.temp_C, 1e-2)},
               {"points", state.points.size()},
               {"points_valid", valid},
               {"monitoring", plc::registers::MonitoringWord(state.monitoring)},
               {"loop", plc::registers::MonitoringWord(state.monitoring)},
               {"probes", state.monitoring.probes},
               {"drift_statistic", Rounded(state.monitoring.drift_statistic, 1e-4)},
               {"proposed_model", state.monitoring.model.proposed}};
  Json cameras = Json::array();
  for (const cell::ViewCamera& camera : state.cameras) {
    if (camera.status.configured) cameras.push_back(LensFields(camera.status));
  }
  json["cameras"] = cameras;
  return TextOf(json);
}

std::string PointBody(const cell::ViewPoint& point, const FleetCell& cell, int model_version) {
  std::string name;
  for (const FleetCell::Point& known : cell.points) {
    if (known.id == point.id) name = known.name;
  }
  return TextOf({{"point", point.id},
                 {"name", name},
                 {"valid", point.valid},
                 {"extrapolated", point.extrapolated},
                 {"code", static_cast<int>(point.code)},
                 {"reason", Describe(point.code)},
                 {"correction_mm", MillimetresOf(point.translation_B)},
                 {"correction_size_mm", Millimetres(point.translation_B.norm())},
                 {"command_mm", MillimetresOf(point.X_BP_command.p)},
                 {"uncertainty_mm", Millimetres(point.uncertainty_m)},
                 {"basis", Describe(point.basis)},
                 {"model", model_version}});
}

std::string LensBody(const status::CameraStatus& status) {
  Json json = LensFields(status);
  json["zoom_counts"] = status.zoom_counts ? Json(*status.zoom_counts) : Json(nullptr);
  json["board_views"] = status.board_views;
  return TextOf(json);
}

std::string ModelBody(const cell::ViewState& state, int before) {
  return TextOf({{"model", state.model_version},
                 {"before", before < 0 ? Json(nullptr) : Json(before)},
                 {"declared", state.monitoring.model.declared},
                 {"proposed", state.monitoring.model.proposed}});
}

std::string ProbeBody(const ProbeRow& probe) {
  const Vec3 residual_m = *probe.measured_W - *probe.predicted_W;
  return TextOf({{"journal", probe.journal},
                 {"id", probe.id},
                 {"source", NameOf(probe.source)},
                 {"session", probe.session},
                 {"model", probe.model_version.value_or(0)},
                 {"measured_mm", MillimetresOf(*probe.measured_W)},
                 {"predicted_mm", MillimetresOf(*probe.predicted_W)},
                 {"residual_mm", MillimetresOf(residual_m)},
                 {"residual_size_mm", Millimetres(residual_m.norm())},
                 {"payload_kg", OptionalNumber(probe.payload_kg, 1e-3)},
                 {"temp_C", OptionalNumber(probe.temp_C, 1e-2)},
                 {"wild", probe.wild},
                 {"alarm", probe.alarm},
                 {"quarantined", !probe.counts()}});
}

std::string AlarmBody(const char* word, int bit, const std::string& meaning, bool begins) {
  return TextOf(
      {{"word", word}, {"bit", bit}, {"event", begins ? "begin" : "end"}, {"meaning", meaning}});
}

std::string LostBody(const FleetQueue::Dropped& dropped) {
  return TextOf({{"states", dropped[0]}, {"changes", dropped[1]}, {"others", dropped[2]}});
}

}  // namespace plumbline::plant
