#include "app/display/page/status_json.h"

#include "app/base/text/json_text.h"
#include "app/cell/view_link/json_values.h"
#include "app/display/page/camera_facts.h"
#include "app/display/page/metrics.h"
#include "app/display/view/status_text.h"
#include "app/version.h"
#include "drivers/plc/register_map.h"
#include "firmware-like/geometry/units.h"
#include "firmware-like/model/joint_columns.h"

namespace plumbline::display {
namespace {

using Json = nlohmann::ordered_json;

const char* ToneWord(display::Tone tone) {
  return tone == display::Tone::kGood        ? "good"
         : tone == display::Tone::kAttention ? "attention"
         : tone == display::Tone::kBad       ? "bad"
         : tone == display::Tone::kFaded     ? "faded"
                                             : "plain";
}

Json LineJson(const display::PanelLine& line) {
  return {{"text", line.text}, {"tone", ToneWord(line.tone)}};
}

Json StripJson(const display::StateStrip& strip) {
  return {{"class", display::MarkOf(strip.state).name},
          {"glyph", display::MarkOf(strip.state).glyph},
          {"word", strip.word},
          {"reason", strip.reason},
          {"do", strip.remedy}};
}

Json TilesJson(const std::vector<display::PointTile>& tiles) {
  Json list = Json::array();
  for (const display::PointTile& tile : tiles) {
    list.push_back({{"id", tile.id},
                    {"name", tile.name},
                    {"class", display::MarkOf(tile.state).name},
                    {"glyph", display::MarkOf(tile.state).glyph},
                    {"value", tile.value},
                    {"radius", tile.radius},
                    {"note", tile.note}});
  }
  return list;
}

Json WordsJson(std::uint16_t word, std::span<const plc::BitMeaning> bits) {
  Json list = Json::array();
  for (const plc::BitMeaning& bit : bits) {
    if ((word & bit.mask) != 0) list.push_back(bit.meaning);
  }
  return list;
}

/// Commanded joint positions of a point, in SI and in the units of the configuration (deg, mm).
Json PostureJson(const cell::ViewPoint& point, const std::vector<model::JointType>& types) {
  Json json = {
      {"q", cell::VectorJson(point.q)}, {"taught", point.taught}, {"differs", point.differs}};
  if (types.size() != static_cast<std::size_t>(point.q.size())) return json;
  json["joints"] = Json::array();
  for (std::size_t i = 0; i < types.size(); ++i) {
    const model::JointColumnForm& form = model::PositionForm(types[i]);
    const double shown = form.from_SI * point.q[static_cast<int>(i)];
    json["joints"].push_back({{"value", text::NumberJson(shown)}, {"unit", form.unit}});
  }
  return json;
}

Json PointsJson(const display::DisplayStatus& now) {
  Json list = Json::array();
  for (const cell::ViewPoint& point : now.state->points) {
    const auto name = now.point_names.find(point.id);
    Json entry = {{"id", point.id},
                  {"name", name == now.point_names.end() ? "" : name->second},
                  {"valid", point.valid},
                  {"reason", point.valid ? std::string(Describe(point.code))
                                         : display::InvalidReason(point, *now.state)},
                  {"tone", LineJson({"", display::ToneOf(point, *now.state)}).at("tone")},
                  {"extrapolated", point.extrapolated}};
    if (point.valid) {
      entry["p_B_m"] = cell::VectorJson(point.X_BP_command.p);
      entry["translation_B_m"] = cell::VectorJson(point.translation_B);
      entry["uncertainty_m"] = point.uncertainty_m > 0 ? Json(point.uncertainty_m) : Json(nullptr);
      entry["basis"] = Describe(point.basis);
      entry["posture"] = PostureJson(point, now.joints);
    }
    list.push_back(entry);
  }
  return list;
}

Json CamerasJson(const display::DisplayStatus& now, double now_s) {
  Json list = Json::array();
  for (const CameraFacts& facts : CamerasOf(now)) {
    const cell::ViewCamera& camera = *facts.camera;
    const status::CameraStatus& status = camera.status;
    Json tags = Json::array(), contradicting = Json::array();
    for (std::size_t k = 0; k < status.contradicting_count; ++k) {
      contradicting.push_back(status.contradicting_tags[k]);
    }
    for (const cell::ViewTag& tag : camera.tags) tags.push_back(tag.id);
    Json entry = {{"name", facts.name},
                  {"serial", camera.serial},
                  {"mode", camera.mode},
                  {"images_per_s", text::NumberJson(facts.images_per_s)},
                  {"image_age_s", nullptr},
                  {"lens_state", std::string(lens::ZoomStateText(status.state))},
                  {"lens_reason", std::string(lens::ZoomReasonText(status.reason))},
                  {"lens_valid", status.state == lens::ZoomState::kValid},
                  {"lens_id", status.lens_id},
                  {"focal_length_px", camera.lens ? Json(camera.lens->fx) : Json(nullptr)},
                  {"usable_radius_px", cell::OptionalJson(camera.usable_radius_px)},
                  {"rests_on_no_window", status.rests_on_no_window},
                  {"rests_on_fixed_focus", status.rests_on_fixed_focus},
                  {"prompt", std::string(lens::BoardPromptText(status.prompt))},
                  {"board_views", status.board_views},
                  {"zoom_counts", cell::OptionalJson(status.zoom_counts)},
                  {"focus_counts", cell::OptionalJson(status.focus_counts)},
                  {"tags", tags},
                  {"contradicting_tags", contradicting},
                  {"opencv_prints", status.opencv_prints}};
    if (camera.image) {
      entry["width"] = camera.image->width;
      entry["height"] = camera.image->height;
      entry["image_age_s"] = std::max(0.0, now_s - camera.image->time_s);
    }
    list.push_back(entry);
  }
  return list;
}

Json PairsJson(const std::vector<cell::MeasuredPair>& pairs) {
  Json list = Json::array();
  for (const cell::MeasuredPair& pair : pairs) {
    Json entry = {{"a", pair.a}, {"b", pair.b}, {"measured", pair.separation.has_value()}};
    if (pair.separation) {
      entry["touching"] = pair.separation->touching;
      entry["distance_m"] = text::NumberJson(pair.separation->distance_m);
    }
    list.push_back(entry);
  }
  return list;
}

void AddStateTo(Json& json, const display::DisplayStatus& now, double now_s) {
  const cell::ViewState& state = *now.state;
  json["cell"] = state.cell;
  json["utc_s"] = state.utc_s;
  const CellHealth& health = now.health;
  json["health"] = {{"severity", static_cast<int>(health.severity)},
                    {"word", Describe(health.severity)},
                    {"reason", Describe(health.reason)},
                    {"do", now.remedy}};
  json["alarms"] = {{"word", state.alarms},
                    {"says", WordsJson(state.alarms, plc::registers::AlarmBits())},
                    {"do", state.alarms != 0 ? now.remedy : ""}};
  json["warnings"] = {{"word", state.warnings},
                      {"says", WordsJson(state.warnings, plc::registers::WarningBits())}};
  const bool read = (state.alarms & alarm::kRobotMissing) == 0;
  json["robot"] = {{"data_age_s", read ? text::NumberJson(state.data_age_s) : Json(nullptr)},
                   {"problem", state.robot_problem},
                   {"do", state.robot_remedy},
                   {"q", cell::VectorJson(state.q)},
                   {"payload_kg", cell::OptionalJson(state.payload_kg)},
                   {"temperature_C", cell::OptionalJson(state.temp_C)}};
  json["motion"] = {{"state", motion::Describe(state.motion.state)},
                    {"age_s", text::NumberJson(state.motion.age_s)},
                    {"tip_acceleration_m_s2", text::NumberJson(state.motion.tip_acceleration)},
                    {"tip_W_m", cell::VectorJson(state.motion.tip_W)},
                    {"radius_m", text::NumberJson(state.motion.radius_m)}};
  json["cycle"] = {{"uptime_s", text::NumberJson(state.cycle.uptime_s)},
                   {"cycles", state.cycle.cycles},
                   {"late", state.cycle.late},
                   {"longest_s", text::NumberJson(state.cycle.longest_s)}};
  json["points"] = PointsJson(now);
  const status::MonitoringStatus& monitoring = state.monitoring;
  json["model"] = {{"version", state.model_version},
                   {"proposed", monitoring.model.proposed},
                   {"recording", monitoring.recording},
                   {"probes", monitoring.probes},
                   {"drift", text::NumberJson(monitoring.drift_statistic)},
                   {"drift_alarm", monitoring.drift_alarm},
                   {"radius_contradicted", monitoring.radius_contradicted},
                   {"diagnosing", monitoring.diagnosing},
                   {"residual_m", cell::VectorJson(monitoring.residual_m)}};
  json["cameras"] = CamerasJson(now, now_s);
  json["pairs"] = PairsJson(now.pairs);
}

Json LogJson(const std::vector<RecentLogEntry>& log) {
  Json list = Json::array();
  for (const RecentLogEntry& line : log) {
    list.push_back(
        {{"utc_s", line.utc_s}, {"level", line.level}, {"from", line.from}, {"text", line.text}});
  }
  return list;
}

}  // namespace

std::string StatusJson(const display::DisplayStatus* now, const PictureFacts& picture,
                       const std::vector<RecentLogEntry>& log, double now_s) {
  const bool there = DaemonReports(now, now_s);
  Json json = {
      {"schema", kStatusSchema},
      {"version", PLUMBLINE_VERSION},
      {"build", kVersionAndBuild},
      {"daemon", {{"there", there}, {"age_s", nullptr}, {"problem", ""}}},
      {"view", {{"age_s", now != nullptr ? Json(now_s - now->time_s) : Json(nullptr)}}},
      {"page", {{"start", picture.server_start}}},
      {"picture", {{"age_s", nullptr}, {"problem", ""}}},
      {"headline", LineJson({"STARTING: no status yet", display::Tone::kFaded})},
      {"strip", StripJson({display::StateClass::kUnknown, "STARTING", "no status yet", ""})},
      {"tiles", Json::array()},
      {"panels", Json::array()}};
  if (picture.size.width > 0) {
    json["picture"]["age_s"] = picture.age_s;
    json["picture"]["width"] = picture.size.width;
    json["picture"]["height"] = picture.size.height;
  }
  if (now != nullptr) {
    json["daemon"]["problem"] = now->link_problem;
    json["picture"]["problem"] = now->picture_problem;
    const display::DisplayStatus shown = display::WithdrawIfSilent(*now, now_s);
    json["headline"] = LineJson(shown.headline);
    json["strip"] = StripJson(shown.strip);
    json["tiles"] = TilesJson(shown.tiles);
    for (const display::Panel& panel : now->panels) {
      Json lines = Json::array();
      for (const display::PanelLine& line : panel.lines) lines.push_back(LineJson(line));
      json["panels"].push_back({{"title", panel.title}, {"lines", lines}});
    }
    if (now->state) {
      json["daemon"]["age_s"] = now_s - now->state->now_s;
      json["daemon"]["version"] = now->state->version;
      AddStateTo(json, shown, now_s);
    }
  }
  json["log"] = LogJson(log);
  return text::JsonText(json);
}

}  // namespace plumbline::display
