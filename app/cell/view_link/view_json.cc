#include "app/cell/view_link/view_json.h"

#include <fmt/format.h>

#include <array>

#include "app/base/text/json_integer.h"
#include "app/base/text/json_text.h"
#include "app/cell/view_link/camera_json.h"
#include "app/cell/view_link/json_values.h"

namespace plumbline::cell {
namespace {

constexpr std::array kMonitoringFlags = {
    Flag<status::MonitoringStatus>{"recording", &status::MonitoringStatus::recording},
    Flag<status::MonitoringStatus>{"drift_alarm", &status::MonitoringStatus::drift_alarm},
    Flag<status::MonitoringStatus>{"learning", &status::MonitoringStatus::learning},
    Flag<status::MonitoringStatus>{"reference_refused",
                                   &status::MonitoringStatus::reference_refused},
    Flag<status::MonitoringStatus>{"radius_contradicted",
                                   &status::MonitoringStatus::radius_contradicted},
    Flag<status::MonitoringStatus>{"diagnosing", &status::MonitoringStatus::diagnosing},
    Flag<status::MonitoringStatus>{"fault", &status::MonitoringStatus::fault},
    Flag<status::MonitoringStatus>{"storage_unavailable",
                                   &status::MonitoringStatus::storage_unavailable},
};

Json CamerasJson(const std::vector<ViewCamera>& cameras) {
  Json list = Json::array();
  for (const ViewCamera& camera : cameras) list.push_back(CameraJson(camera));
  return list;
}

Json PointJson(const ViewPoint& point) {
  return {{"id", point.id},
          {"valid", point.valid},
          {"extrapolated", point.extrapolated},
          {"code", static_cast<int>(point.code)},
          {"X_BP_command", PoseJson(point.X_BP_command)},
          {"translation_B_m", VectorJson(point.translation_B)},
          {"uncertainty_m", NumberJson(point.uncertainty_m)},
          {"basis", static_cast<int>(point.basis)},
          {"q", VectorJson(point.q)},
          {"taught", point.taught},
          {"differs", point.differs}};
}

ViewPoint PointOf(const Json& json) {
  ViewPoint point;
  point.id = text::IntegerFromJson<int>(json.at("id"));
  point.valid = json.at("valid").get<bool>();
  point.extrapolated = json.at("extrapolated").get<bool>();
  point.code = EnumOf(json.at("code"), correction::kLastCorrectionCode);
  point.X_BP_command = PoseOfJson(json.at("X_BP_command"));
  point.translation_B = Vec3Of(json.at("translation_B_m"));
  point.uncertainty_m = NumberOf(json.at("uncertainty_m"));
  point.basis = EnumOf(json.at("basis"), model::RadiusBasis::kMeasured);
  point.q = JointsOf(ListAt(json, "q"));
  point.taught = json.at("taught").get<bool>();
  point.differs = json.at("differs").get<bool>();
  return point;
}

Json MotionJson(const ViewMotion& motion) {
  return {{"state", static_cast<int>(motion.state)},
          {"age_s", NumberJson(motion.age_s)},
          {"sag", VectorJson(motion.sag)},
          {"acceleration_F", VectorJson(motion.acceleration_F)},
          {"angular_acceleration_F", VectorJson(motion.angular_acceleration_F)},
          {"tip_acceleration", NumberJson(motion.tip_acceleration)},
          {"tip_W_m", VectorJson(motion.tip_W)},
          {"radius_m", NumberJson(motion.radius_m)}};
}

ViewMotion MotionOf(const Json& json) {
  ViewMotion motion;
  motion.state = EnumOf(json.at("state"), motion::MotionState::kLoadUnknown);
  motion.age_s = NumberOf(json.at("age_s"));
  motion.sag = JointsOf(ListAt(json, "sag"));
  motion.acceleration_F = Vec3Of(json.at("acceleration_F"));
  motion.angular_acceleration_F = Vec3Of(json.at("angular_acceleration_F"));
  motion.tip_acceleration = NumberOf(json.at("tip_acceleration"));
  motion.tip_W = Vec3Of(json.at("tip_W_m"));
  motion.radius_m = NumberOf(json.at("radius_m"));
  return motion;
}

Json MonitoringJson(const status::MonitoringStatus& status) {
  Json json = {{"applied", status.model.applied},
               {"proposed", status.model.proposed},
               {"declared", status.model.declared},
               {"probes", status.probes},
               {"quarantined", status.quarantined},
               {"reference_learned", status.reference_learned},
               {"reference_wanted", status.reference_wanted},
               {"drift_statistic", NumberJson(status.drift_statistic)},
               {"residual_m", VectorJson(status.residual_m)}};
  AddFlags(status, kMonitoringFlags, json);
  return json;
}

status::MonitoringStatus MonitoringOf(const Json& json) {
  status::MonitoringStatus status;
  ReadFlags(json, kMonitoringFlags, status);
  status.model.applied = text::IntegerFromJson<int>(json.at("applied"));
  status.model.proposed = text::IntegerFromJson<int>(json.at("proposed"));
  status.model.declared = text::IntegerFromJson<int>(json.at("declared"));
  status.probes = text::IntegerFromJson<std::uint32_t>(json.at("probes"));
  status.reference_learned = text::IntegerFromJson<int>(json.at("reference_learned"));
  status.reference_wanted = text::IntegerFromJson<int>(json.at("reference_wanted"));
  status.quarantined = text::IntegerFromJson<std::uint32_t>(json.at("quarantined"));
  status.drift_statistic = NumberOf(json.at("drift_statistic"));
  status.residual_m = Vec3Of(json.at("residual_m"));
  return status;
}

Json CycleJson(const ViewCycle& cycle) {
  return {{"uptime_s", NumberJson(cycle.uptime_s)},
          {"longest_s", NumberJson(cycle.longest_s)},
          {"cycles", cycle.cycles},
          {"late", cycle.late},
          {"starts", cycle.starts.counts},
          {"starts_sum_s", cycle.starts.sum_s}};
}

ViewCycle CycleOf(const Json& json) {
  ViewCycle cycle{NumberOf(json.at("uptime_s")),
                  NumberOf(json.at("longest_s")),
                  text::IntegerFromJson<std::uint64_t>(json.at("cycles")),
                  text::IntegerFromJson<std::uint64_t>(json.at("late")),
                  {}};
  const Json& starts = ListAt(json, "starts");
  if (starts.size() != cycle.starts.counts.size())
    throw std::out_of_range("another number of lateness classes");
  for (std::size_t k = 0; k < starts.size(); ++k) {
    cycle.starts.counts[k] = text::IntegerFromJson<std::uint64_t>(starts[k]);
  }
  cycle.starts.sum_s = json.at("starts_sum_s").get<double>();
  return cycle;
}

Json LinesJson(const std::vector<ViewLine>& lines) {
  Json list = Json::array();
  for (const ViewLine& line : lines) {
    list.push_back({{"number", line.number},
                    {"utc_s", line.utc_s},
                    {"level", line.level},
                    {"text", line.text}});
  }
  return list;
}

ViewState StateOf(const Json& json) {
  if (const int schema = text::IntegerFromJson<int>(json.at("schema")); schema != kViewSchema) {
    throw std::out_of_range(fmt::format(
        "schema {} instead of {}: plumblined and this program are of different versions", schema,
        kViewSchema));
  }
  ViewState state;
  state.now_s = json.at("now_s").get<double>();
  state.utc_s = json.at("utc_s").get<double>();
  state.version = json.at("version").get<std::string>();
  state.cell = json.at("cell").get<std::string>();
  state.model_version = text::IntegerFromJson<int>(json.at("model_version"));
  state.status = text::IntegerFromJson<std::uint16_t>(json.at("status"));
  state.alarms = text::IntegerFromJson<std::uint16_t>(json.at("alarms"));
  state.warnings = text::IntegerFromJson<std::uint16_t>(json.at("warnings"));
  const auto reason = EnumOf(json.at("health"), kLastHealthReason);
  state.health = {SeverityOf(reason), reason};
  state.data_age_s = NumberOf(json.at("data_age_s"));
  state.cycle = CycleOf(json.at("cycle"));
  state.q = JointsOf(ListAt(json, "q"));
  state.motion = MotionOf(json.at("motion"));
  state.payload_kg = OptionalOf<double>(json.at("payload_kg"));
  state.payload_cog_F = Vec3Of(json.at("payload_cog_F_m"));
  if (json.contains("tool")) state.tool = text::IntegerFromJson<std::uint16_t>(json.at("tool"));
  if (json.contains("payload_problem")) {
    state.payload_problem = json.at("payload_problem").get<std::string>();
    state.payload_remedy = json.at("payload_remedy").get<std::string>();
  }
  if (json.contains("robot_problem")) {
    state.robot_problem = json.at("robot_problem").get<std::string>();
    state.robot_remedy = json.at("robot_remedy").get<std::string>();
  }
  state.temp_C = OptionalOf<double>(json.at("temp_C"));
  state.monitoring = MonitoringOf(json.at("monitoring"));
  for (const Json& camera : ListAt(json, "cameras")) state.cameras.push_back(CameraOf(camera));
  if (state.cameras.size() > model::kMaxCameras) throw std::out_of_range("too many cameras");
  for (const Json& line : ListAt(json, "lines")) {
    state.lines.push_back(
        {text::IntegerFromJson<std::uint64_t>(line.at("number")), line.at("utc_s").get<double>(),
         text::IntegerFromJson<int>(line.at("level")), line.at("text").get<std::string>()});
  }
  return state;
}

std::vector<ViewPoint> PointsOf(const Json& json) {
  if (!json.is_array()) throw std::out_of_range("the points are not a list");
  std::vector<ViewPoint> points;
  points.reserve(json.size());
  for (const Json& point : json) points.push_back(PointOf(point));
  return points;
}

/// The value that `read` takes from the text; never throws.
template <typename Read>
auto Parsed(std::string_view text, Read read) -> Result<decltype(read(Json()))> {
  const auto unreadable = [](std::string_view why) {
    return Error{fmt::format(
        "data from plumblined cannot be read: {}; restart plumblined and this program, so that "
        "both are of the same version",
        why)};
  };
  try {
    const Result<Json> json = text::JsonFromText<Json>(text);
    if (json) return read(*json);
    return unreadable(json.error());
  } catch (const std::exception& why) {
    return unreadable(why.what());
  }
}

}  // namespace

std::string JsonOfView(const ViewState& state) {
  const Json json = {{"schema", kViewSchema},
                     {"now_s", state.now_s},
                     {"utc_s", state.utc_s},
                     {"version", state.version},
                     {"cell", state.cell},
                     {"model_version", state.model_version},
                     {"status", state.status},
                     {"alarms", state.alarms},
                     {"warnings", state.warnings},
                     {"health", static_cast<int>(state.health.reason)},
                     {"data_age_s", NumberJson(state.data_age_s)},
                     {"cycle", CycleJson(state.cycle)},
                     {"q", VectorJson(state.q)},
                     {"motion", MotionJson(state.motion)},
                     {"payload_kg", OptionalJson(state.payload_kg)},
                     {"payload_cog_F_m", VectorJson(state.payload_cog_F)},
                     {"payload_problem", state.payload_problem},
                     {"payload_remedy", state.payload_remedy},
                     {"robot_problem", state.robot_problem},
                     {"robot_remedy", state.robot_remedy},
                     {"tool", state.tool},
                     {"temp_C", OptionalJson(state.temp_C)},
                     {"monitoring", MonitoringJson(state.monitoring)},
                     {"cameras", CamerasJson(state.cameras)},
                     {"lines", LinesJson(state.lines)}};
  return text::JsonText(json);
}

std::string JsonOfPoints(const std::vector<ViewPoint>& points) {
  Json list = Json::array();
  for (const ViewPoint& point : points) list.push_back(PointJson(point));
  return text::JsonText(list);
}

Result<ViewState> ViewOfJson(std::string_view text) {
  return Parsed(text, StateOf);
}

Result<std::vector<ViewPoint>> PointsOfJson(std::string_view text) {
  return Parsed(text, PointsOf);
}

}  // namespace plumbline::cell
