#include "app/plant/publish/message_text.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>

#include "app/base/text/json_text.h"
#include "app/version.h"
#include "drivers/plc/register_map.h"
#include "firmware-like/geometry/units.h"
#include "firmware-like/model/joint_columns.h"
#include "firmware-like/snapshot.h"

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

/// More than what MessageText() adds to a body.
constexpr std::size_t kEnvelope_bytes = 200;
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

/// The number that this text is, so that formatting it again gives the text.
Json NumberOf(const std::string& text) {
  const double value = std::strtod(text.c_str(), nullptr);
  return std::isfinite(value) ? Json(value) : Json(nullptr);
}

/// With the decimals that it has in an exported measured.csv.
Json Tabulated(double value, int decimals) {
  return NumberOf(fmt::format("{:.{}f}", value, decimals));
}

Json TabulatedPoint(const Vec3& point_m) {
  Json list = Json::array();
  for (int k = 0; k < 3; ++k) list.push_back(Tabulated(point_m[k] * kMmPerMetre, 5));
  return list;
}

/// Adds the values in the units of an exported measured.csv, unless they were not recorded.
void AddJointValues(Json& json, const char* name, const model::JointVector& values,
                    const std::vector<model::Joint>& joints, model::JointQuantity quantity,
                    int decimals) {
  if (values.size() == 0 || values.size() != static_cast<Eigen::Index>(joints.size())) return;
  Json list = Json::array();
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const double unit = model::FormOf(quantity, joints[i].type).to_SI;
    list.push_back(Tabulated(values[static_cast<Eigen::Index>(i)] / unit, decimals));
  }
  json[name] = std::move(list);
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
  Json json = {
      {"timestamp", utc_ms},
      {"bdSeq", bdSeq},
      {"schema", kFleetSchema},
      {"version", PLUMBLINE_VERSION},
      {"cell", cell.cell},
      {"joints", cell.joints.size()},
      {"points", points},
      {"stream", queue.stream()},
      {"waiting", queue.size()},
      {"dropped", {{"states", dropped[0]}, {"changes", dropped[1]}, {"others", dropped[2]}}}};
  std::string text = TextOf(json);
  if (text.size() <= kLongestMessage_bytes) return text;
  json["points"] = Json::array();
  json["points_omitted"] = cell.points.size();
  return TextOf(json);
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

std::string ProbeBody(const ProbeRow& probe, const std::vector<model::Joint>& joints) {
  const bool compared = probe.measured_W && probe.predicted_W;
  const Vec3 residual_m = compared ? Vec3(*probe.measured_W - *probe.predicted_W) : Vec3::Zero();
  const auto point = [](const std::optional<Vec3>& point_m) {
    return point_m ? TabulatedPoint(*point_m) : Json(nullptr);
  };
  Json json = {{"journal", probe.journal},
               {"id", probe.id},
               {"source", NameOf(probe.source)},
               {"session", probe.session},
               {"model", probe.model_version.value_or(0)},
               {"measured_mm", point(probe.measured_W)},
               {"predicted_mm", point(probe.predicted_W)},
               {"residual_mm", compared ? MillimetresOf(residual_m) : Json(nullptr)},
               {"residual_size_mm", compared ? Millimetres(residual_m.norm()) : Json(nullptr)},
               {"payload_kg", probe.payload_kg ? Tabulated(*probe.payload_kg, 6) : Json(nullptr)},
               {"temp_C", probe.temp_C ? Tabulated(*probe.temp_C, 4) : Json(nullptr)},
               {"wild", probe.wild},
               {"alarm", probe.alarm},
               {"quarantined", !probe.counts()}};
  const auto add = [&json](const char* name, const std::optional<double>& value, int decimals) {
    if (value) json[name] = Tabulated(*value, decimals);
  };
  const auto add_mm = [&add](const char* name, const std::optional<double>& length_m) {
    add(name, length_m ? std::optional(*length_m * kMmPerMetre) : std::nullopt, 5);
  };
  add("t_s", probe.t_s, 6);
  using Quantity = model::JointQuantity;
  AddJointValues(json, "q", probe.q, joints, Quantity::kPosition, 7);
  AddJointValues(json, "qd", probe.qd, joints, Quantity::kVelocity, 6);
  AddJointValues(json, "qdd", probe.qdd, joints, Quantity::kAcceleration, 6);
  AddJointValues(json, "tau", probe.tau, joints, Quantity::kTorque, 4);
  if (probe.q_step_rad) add("q_step_deg", *probe.q_step_rad / kRadPerDeg, 7);
  if (probe.tool_number) json["tool"] = *probe.tool_number;
  if (probe.payload_item) json["payload_item"] = *probe.payload_item;
  if (probe.orientation_W) {
    const auto& turn = *probe.orientation_W;
    json["orientation"] = {Tabulated(turn.w(), 9), Tabulated(turn.x(), 9), Tabulated(turn.y(), 9),
                           Tabulated(turn.z(), 9)};
  }
  add_mm("range_mm", probe.range_m);
  if (!probe.artefact.empty()) json["artefact"] = probe.artefact;
  add_mm("gauge_mm", probe.gauge_m);
  add_mm("sigma_mm", probe.sigma_m);
  if (!probe.camera.empty()) json["camera"] = probe.camera;
  add_mm("predicted_radius_mm", probe.predicted_radius_m);
  if (probe.covariance_W) {
    Json values = Json::array();
    for (int k = 0; k < 9; ++k) {
      const double value_mm2 = (*probe.covariance_W)(k / 3, k % 3) * kMmPerMetre * kMmPerMetre;
      values.push_back(NumberOf(fmt::format("{:.6g}", value_mm2)));
    }
    json["covariance_mm2"] = std::move(values);
  }
  return TextOf(json);
}

std::string CellBody(const FleetCell& cell, const CellInForce& in_force) {
  Json json = {{"model", in_force.model}, {"fingerprint", in_force.fingerprint}};
  const auto add = [&json](const char* name, const std::string& value) {
    if (!value.empty()) json[name] = value;
  };
  add("arm_model", cell.arm.model);
  add("arm_series", cell.arm.series);
  add("installed", cell.arm.installed);
  add("page", cell.page);
  json["cell"] = in_force.text;
  std::string text = TextOf(json);
  if (text.size() <= kLongestCell_bytes - kEnvelope_bytes) return text;
  json.erase("cell");
  json["cell_omitted"] = fmt::format("the cell has {} bytes, more than a message of {} bytes holds",
                                     in_force.text.size(), kLongestCell_bytes);
  return TextOf(json);
}

std::string AlarmBody(const char* word, int bit, const std::string& meaning, bool begins) {
  return TextOf(
      {{"word", word}, {"bit", bit}, {"event", begins ? "begin" : "end"}, {"meaning", meaning}});
}

std::string LostBody(const FleetQueue::Dropped& dropped) {
  return TextOf({{"states", dropped[0]}, {"changes", dropped[1]}, {"others", dropped[2]}});
}

}  // namespace plumbline::plant
