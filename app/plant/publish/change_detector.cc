#include "app/plant/publish/change_detector.h"

#include <fmt/format.h>

#include <bit>
#include <cmath>

#include "app/base/text/json_text.h"
#include "app/version.h"
#include "drivers/plc/register_map.h"
#include "firmware-like/geometry/units.h"
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

constexpr int kMemorySchema = 1;
/// Status bits that change in normal operation and are irrelevant to a plant.
constexpr std::uint16_t kVolatileBits = status::kToggle | status::kBusy | status::kResultValid;

std::int64_t Milliseconds(double utc_s) {
  return std::llround(1e3 * utc_s);
}

bool Differs(const cell::ViewPoint& a, const cell::ViewPoint& b, double change_m) {
  return a.valid != b.valid || a.extrapolated != b.extrapolated || a.code != b.code ||
         (a.valid && !((a.translation_B - b.translation_B).norm() <= change_m));
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

ChangeDetector::ChangeDetector(const config::MqttConfig& config, FleetCell cell,
                               const std::string& memory)
    : config_(config), cell_(std::move(cell)) {
  const auto json = text::JsonOrNull(memory);
  if (!json.is_object() || json.value("schema", 0) != kMemorySchema) return;
  alarms_ = json.value("alarms", std::uint16_t{0});
  warnings_ = json.value("warnings", std::uint16_t{0});
  silent_ = json.value("silent", false);
  model_version_ = json.value("model", kNotReported);
  lenses_ = json.value("lenses", std::vector<int>());
}

std::string ChangeDetector::Memory() const {
  return text::JsonText(nlohmann::ordered_json{{"schema", kMemorySchema},
                                               {"alarms", alarms_},
                                               {"warnings", warnings_},
                                               {"silent", silent_},
                                               {"model", model_version_},
                                               {"lenses", lenses_}});
}

void ChangeDetector::UpdateWord(const char* word, std::uint16_t bits,
                                std::span<const plc::BitMeaning> meanings, std::uint16_t& reported,
                                std::map<std::uint16_t, TimedBit>& timed,
                                const cell::ViewState& state, double now_s,
                                std::vector<Message>& messages) {
  for (const plc::BitMeaning& meaning : meanings) {
    TimedBit& bit = timed[meaning.mask];
    const bool set = (bits & meaning.mask) != 0, was = (reported & meaning.mask) != 0;
    if (set || bit.seen_s < -1e299) {  // reported by a previous run: its time starts now
      bit.seen_s = now_s;
      bit.seen_utc_s = state.utc_s;
    }
    if (set == was || (was && now_s - bit.seen_s < kAlarmOff_s)) continue;
    reported = static_cast<std::uint16_t>(reported ^ meaning.mask);
    messages.push_back({MessageKind::kAlarm, Milliseconds(bit.seen_utc_s),
                        AlarmBody(word, std::countr_zero(meaning.mask), meaning.meaning, set)});
  }
}

void ChangeDetector::UpdatePoints(const cell::ViewState& state, double now_s,
                                  std::vector<Message>& messages) {
  for (const cell::ViewPoint& point : state.points) {
    if (point.code == correction::CorrectionCode::kPending) continue;
    const auto known = points_.find(point.id);
    if (known != points_.end() && (now_s - known->second.at_s < config_.change_period_s ||
                                   !Differs(point, known->second.point, config_.point_change_m))) {
      continue;
    }
    points_[point.id] = {point, now_s};
    messages.push_back({MessageKind::kPoint, Milliseconds(state.utc_s),
                        PointBody(point, cell_, state.model_version)});
  }
}

void ChangeDetector::UpdateState(const cell::ViewState& state, double now_s,
                                 std::vector<Message>& messages) {
  std::vector<int> summary = {state.status & ~kVolatileBits, state.alarms, state.warnings,
                              state.model_version,
                              plc::registers::MonitoringWord(state.monitoring)};
  summary.insert(summary.end(), lenses_.begin(), lenses_.end());
  const double since_s = now_s - state_s_;
  if (since_s < config_.change_period_s) return;
  if (since_s < config_.state_period_s && summary == summary_) return;
  state_s_ = now_s;
  summary_ = std::move(summary);
  messages.push_back({MessageKind::kState, Milliseconds(state.utc_s), StateBody(state, cell_)});
}

void ChangeDetector::UpdateLenses(const cell::ViewState& state, std::vector<Message>& messages) {
  lenses_.resize(state.cameras.size(), kNotReported);
  for (std::size_t k = 0; k < lenses_.size(); ++k) {
    const status::CameraStatus& status = state.cameras[k].status;
    const int lens = status.configured ? static_cast<int>(status.state) : kNotReported;
    if (lens == lenses_[k]) continue;
    lenses_[k] = lens;
    if (!status.configured) continue;
    messages.push_back({MessageKind::kLens, Milliseconds(state.utc_s), LensBody(status)});
  }
}

std::vector<Message> ChangeDetector::Update(const cell::ViewState& state, double now_s) {
  std::vector<Message> messages;
  received_s_ = now_s;
  if (silent_) {
    silent_ = false;
    messages.push_back({MessageKind::kAlarm, Milliseconds(state.utc_s),
                        AlarmBody("fleet", 0, "no data from plumblined", false)});
  }
  if (state.model_version != model_version_) {
    messages.push_back(
        {MessageKind::kModel, Milliseconds(state.utc_s), ModelBody(state, model_version_)});
    model_version_ = state.model_version;
  }
  UpdateLenses(state, messages);
  UpdateWord("alarms", state.alarms, plc::registers::AlarmBits(), alarms_, alarm_times_, state,
             now_s, messages);
  UpdateWord("warnings", state.warnings, plc::registers::WarningBits(), warnings_, warning_times_,
             state, now_s, messages);
  UpdatePoints(state, now_s, messages);
  UpdateState(state, now_s, messages);
  return messages;
}

std::vector<Message> ChangeDetector::UpdateWithoutState(double now_s, double utc_s) {
  if (received_s_ < -1e299) received_s_ = now_s;
  if (silent_ || now_s - received_s_ < kSilent_s) return {};
  silent_ = true;
  state_s_ = -1e300;  // report the next state at once
  return {{MessageKind::kAlarm, Milliseconds(utc_s),
           AlarmBody("fleet", 0, "no data from plumblined", true)}};
}

}  // namespace plumbline::plant
