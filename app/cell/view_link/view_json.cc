#include "app/cell/view_link/view_json.h"

#include <fmt/format.h>

#include <array>

#include "app/base/text/json_integer.h"
#include "app/base/text/json_text.h"
#include "app/cell/view_link/json_values.h"
#include "app/cell/view_link/view_state.h"
#include "firmware-like/lens/known_lens.h"

namespace plumbline::cell {
namespace {

// JSON of a camera in a view state: status, image, lens, tags and bodies.

constexpr int kMaxSlots = 16, kMaxSide_px = 16384;

Json ImageJson(const ViewImage& image) {
  return {{"slot", image.slot},        {"stamp", image.stamp},   {"width", image.width},
          {"height", image.height},    {"colour", image.colour}, {"time_s", image.time_s},
          {"sequence", image.sequence}};
}

ViewImage ImageOf(const Json& json) {
  ViewImage image;
  image.slot = IntWithin(json.at("slot"), 0, kMaxSlots - 1);
  image.stamp = text::IntegerFromJson<std::uint32_t>(json.at("stamp"));
  image.width = IntWithin(json.at("width"), 1, kMaxSide_px);
  image.height = IntWithin(json.at("height"), 1, kMaxSide_px);
  image.colour = json.at("colour").get<bool>();
  image.time_s = json.at("time_s").get<double>();
  image.sequence = text::IntegerFromJson<std::uint64_t>(json.at("sequence"));
  return image;
}

Json LensJson(const lens::Lens& l) {
  Json numbers = Json::array();
  for (const double value : lens::VectorOfLens(l)) numbers.push_back(value);
  return {{"values", std::move(numbers)}, {"fisheye", l.fisheye}};
}

lens::Lens LensOf(const Json& json) {
  lens::LensVector v;
  ReadVector(json.at("values"), v);
  if (!(v[0] > 0) || !(v[1] > 0)) throw std::out_of_range("a focal length is not positive");
  return lens::LensOfVector(v, json.at("fisheye").get<bool>());
}

constexpr std::array kCameraFlags = {
    Flag<status::CameraStatus>{"lens_stale", &status::CameraStatus::lens_stale},
    Flag<status::CameraStatus>{"camera_lost", &status::CameraStatus::camera_lost},
    Flag<status::CameraStatus>{"zoom_unknown", &status::CameraStatus::zoom_unknown},
    Flag<status::CameraStatus>{"board_wanted", &status::CameraStatus::board_wanted},
    Flag<status::CameraStatus>{"fiducials_hidden", &status::CameraStatus::fiducials_hidden},
    Flag<status::CameraStatus>{"fiducial_moved", &status::CameraStatus::fiducial_moved},
    Flag<status::CameraStatus>{"store_fault", &status::CameraStatus::store_fault},
    Flag<status::CameraStatus>{"opencv_prints", &status::CameraStatus::opencv_prints},
    Flag<status::CameraStatus>{"rests_on_no_window", &status::CameraStatus::rests_on_no_window},
    Flag<status::CameraStatus>{"rests_on_fixed_focus", &status::CameraStatus::rests_on_fixed_focus},
    Flag<status::CameraStatus>{"tip_valid", &status::CameraStatus::tip_valid},
};
Json CameraStatusJson(const status::CameraStatus& status) {
  Json json = {
      {"configured", status.configured},
      {"name", static_cast<int>(status.name)},
      {"state", static_cast<int>(status.state)},
      {"reason", static_cast<int>(status.reason)},
      {"prompt", static_cast<int>(status.prompt)},
      {"board_views", status.board_views},
      {"zoom_counts", OptionalJson(status.zoom_counts)},
      {"focus_counts", OptionalJson(status.focus_counts)},
      {"lens_id", status.lens_id},
      {"zoom_time_s", NumberJson(status.zoom_time_s)},
      {"frame_time_s", NumberJson(status.frame_time_s)},
      {"tip_W_m", VectorJson(status.tip_W)},
      {"tip_covariance_W_m2",
       VectorJson((status.tip_covariance_W + status.tip_tag_covariance_W).eval().reshaped())},
      {"tip_time_s", NumberJson(status.tip_time_s)}};
  AddFlags(status, kCameraFlags, json);
  json["contradicting_tags"] = Json::array();
  for (std::size_t k = 0; k < status.contradicting_count; ++k) {
    json["contradicting_tags"].push_back(status.contradicting_tags[k]);
  }
  return json;
}

status::CameraStatus CameraStatusOf(const Json& json) {
  status::CameraStatus status;
  status.configured = json.at("configured").get<bool>();
  status.name = EnumOf(json.at("name"), status::CameraName::kTop);
  status.state = EnumOf(json.at("state"), lens::ZoomState::kRefused);
  status.reason = EnumOf(json.at("reason"), lens::kLastZoomReason);
  status.prompt = EnumOf(json.at("prompt"), lens::BoardPrompt::kFarther);
  status.board_views = text::IntegerFromJson<std::uint16_t>(json.at("board_views"));
  status.zoom_counts = OptionalOf<std::int32_t>(json.at("zoom_counts"));
  status.focus_counts = OptionalOf<std::int32_t>(json.at("focus_counts"));
  status.lens_id = text::IntegerFromJson<std::uint32_t>(json.at("lens_id"));
  status.zoom_time_s = NumberOf(json.at("zoom_time_s"));
  status.frame_time_s = NumberOf(json.at("frame_time_s"));
  ReadFlags(json, kCameraFlags, status);
  for (const Json& id : json.at("contradicting_tags")) {
    if (status.contradicting_count == status.contradicting_tags.size()) {
      throw std::out_of_range("too many contradicting tags");
    }
    status.contradicting_tags[status.contradicting_count++] =
        text::IntegerFromJson<std::int32_t>(id);
  }
  status.tip_W = Vec3Of(json.at("tip_W_m"));
  Eigen::Matrix<double, 9, 1> covariance;
  ReadVector(json.at("tip_covariance_W_m2"), covariance);
  status.tip_covariance_W = covariance.reshaped(3, 3);
  status.tip_time_s = NumberOf(json.at("tip_time_s"));
  return status;
}

Json TagJson(const ViewTag& tag) {
  Json corners = Json::array();
  for (const lens::Vec2& corner : tag.corners_px) corners.push_back(VectorJson(corner));
  return {{"id", tag.id},
          {"corners_px", corners},
          {"X_CM", tag.X_CM ? PoseJson(*tag.X_CM) : Json(nullptr)},
          {"ambiguous", tag.ambiguous}};
}

ViewTag TagOf(const Json& entry) {
  ViewTag tag;
  tag.id = text::IntegerFromJson<int>(entry.at("id"));
  for (std::size_t k = 0; k < tag.corners_px.size(); ++k) {
    ReadVector(entry.at("corners_px").at(k), tag.corners_px[k]);
  }
  if (!entry.at("X_CM").is_null()) tag.X_CM = PoseOfJson(entry.at("X_CM"));
  tag.ambiguous = entry.at("ambiguous").get<bool>();
  return tag;
}

Json CameraJson(const ViewCamera& camera) {
  Json json = {{"status", CameraStatusJson(camera.status)},
               {"serial", camera.serial},
               {"mode", camera.mode},
               {"image", camera.image ? ImageJson(*camera.image) : Json(nullptr)},
               {"lens", camera.lens ? LensJson(*camera.lens) : Json(nullptr)},
               {"usable_radius_px",
                camera.usable_radius_px ? Json(*camera.usable_radius_px) : Json(nullptr)},
               {"tags", Json::array()},
               {"bodies", Json::array()}};
  for (const ViewTag& tag : camera.tags) json["tags"].push_back(TagJson(tag));
  for (const ViewBody& body : camera.bodies) {
    json["bodies"].push_back(
        {{"name", body.name}, {"X_CK", PoseJson(body.X_CK)}, {"ambiguous", body.ambiguous}});
  }
  return json;
}

/// @param json  untrusted
/// @throws      std::exception that says which value is missing or implausible
ViewCamera CameraOf(const Json& json) {
  ViewCamera camera;
  camera.status = CameraStatusOf(json.at("status"));
  camera.serial = json.at("serial").get<std::string>();
  camera.mode = json.at("mode").get<std::string>();
  if (!json.at("image").is_null()) camera.image = ImageOf(json.at("image"));
  if (!json.at("lens").is_null()) camera.lens = LensOf(json.at("lens"));
  if (const Json& radius = json.at("usable_radius_px"); !radius.is_null()) {
    camera.usable_radius_px = NumberOf(radius);
    if (!(*camera.usable_radius_px > 0))
      throw std::out_of_range("usable_radius_px is not positive");
  }
  for (const Json& entry : ListAt(json, "tags")) camera.tags.push_back(TagOf(entry));
  for (const Json& entry : ListAt(json, "bodies")) {
    camera.bodies.push_back({entry.at("name").get<std::string>(), PoseOfJson(entry.at("X_CK")),
                             entry.at("ambiguous").get<bool>()});
  }
  return camera;
}

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

// JSON of what was measured between the virtual objects.

Json SeparationJson(const Separation& between) {
  return {{"touching", between.touching},
          {"inside", between.inside},
          {"distance_m", NumberJson(between.distance_m)},
          {"p_a_W_m", VectorJson(between.p_a_W)},
          {"p_b_W_m", VectorJson(between.p_b_W)},
          {"depth_m", NumberJson(between.depth_m)},
          {"penetration_direction_W", VectorJson(between.penetration_direction_W)}};
}

Separation SeparationOf(const Json& json) {
  Separation between;
  between.touching = json.at("touching").get<bool>();
  between.inside = json.at("inside").get<bool>();
  between.distance_m = NumberOf(json.at("distance_m"));
  between.p_a_W = Vec3Of(json.at("p_a_W_m"));
  between.p_b_W = Vec3Of(json.at("p_b_W_m"));
  between.depth_m = NumberOf(json.at("depth_m"));
  between.penetration_direction_W = Vec3Of(json.at("penetration_direction_W"));
  return between;
}

Json SweepJson(const SweepResult& sweep) {
  return {{"hits", sweep.hits},
          {"travelled_m", NumberJson(sweep.travelled_m)},
          {"least_m", NumberJson(sweep.least_m)},
          {"p_W_m", VectorJson(sweep.p_W)}};
}

SweepResult SweepOf(const Json& json) {
  SweepResult sweep;
  sweep.hits = json.at("hits").get<bool>();
  sweep.travelled_m = NumberOf(json.at("travelled_m"));
  sweep.least_m = NumberOf(json.at("least_m"));
  sweep.p_W = Vec3Of(json.at("p_W_m"));
  return sweep;
}

Json SceneJson(const SceneMeasurements& scene) {
  Json json = {{"time_s", NumberJson(scene.time_s)},
               {"took_s", NumberJson(scene.took_s)},
               {"pairs", Json::array()},
               {"distances", Json::array()},
               {"points", Json::array()},
               {"sweeps", Json::array()}};
  for (const MeasuredPair& pair : scene.pairs) {
    json["pairs"].push_back(
        {{"a", pair.a},
         {"b", pair.b},
         {"number_a", pair.number_a},
         {"number_b", pair.number_b},
         {"state", static_cast<int>(pair.state)},
         {"separation", pair.separation ? SeparationJson(*pair.separation) : Json(nullptr)}});
  }
  for (const MeasuredDistance& distance : scene.distances) {
    json["distances"].push_back({{"name", distance.name},
                                 {"distance_m", OptionalJson(distance.distance_m)},
                                 {"p_a_W_m", VectorJson(distance.p_a_W)},
                                 {"p_b_W_m", VectorJson(distance.p_b_W)}});
  }
  for (const PlacedPoint& point : scene.points) {
    json["points"].push_back(
        {{"name", point.name}, {"p_W_m", point.p_W ? VectorJson(*point.p_W) : Json(nullptr)}});
  }
  for (const MeasuredSweep& sweep : scene.sweeps) {
    json["sweeps"].push_back({{"name", sweep.name},
                              {"other", sweep.other},
                              {"result", sweep.result ? SweepJson(*sweep.result) : Json(nullptr)}});
  }
  return json;
}

SceneMeasurements SceneOf(const Json& json) {
  SceneMeasurements scene;
  scene.time_s = NumberOf(json.at("time_s"));
  scene.took_s = NumberOf(json.at("took_s"));
  for (const Json& entry : ListAt(json, "pairs")) {
    MeasuredPair& pair = scene.pairs.emplace_back();
    pair.a = entry.at("a").get<std::string>();
    pair.b = entry.at("b").get<std::string>();
    pair.number_a = text::IntegerFromJson<int>(entry.at("number_a"));
    pair.number_b = text::IntegerFromJson<int>(entry.at("number_b"));
    pair.state = EnumOf(entry.at("state"), scene::Proximity::kInterference);
    if (const Json& between = entry.at("separation"); !between.is_null()) {
      pair.separation = SeparationOf(between);
    }
  }
  for (const Json& entry : ListAt(json, "distances")) {
    scene.distances.push_back({entry.at("name").get<std::string>(),
                               OptionalOf<double>(entry.at("distance_m")),
                               Vec3Of(entry.at("p_a_W_m")), Vec3Of(entry.at("p_b_W_m"))});
  }
  for (const Json& entry : ListAt(json, "points")) {
    PlacedPoint& point = scene.points.emplace_back();
    point.name = entry.at("name").get<std::string>();
    if (const Json& p_W = entry.at("p_W_m"); !p_W.is_null()) point.p_W = Vec3Of(p_W);
  }
  for (const Json& entry : ListAt(json, "sweeps")) {
    MeasuredSweep& sweep = scene.sweeps.emplace_back();
    sweep.name = entry.at("name").get<std::string>();
    sweep.other = entry.at("other").get<std::string>();
    if (const Json& result = entry.at("result"); !result.is_null()) sweep.result = SweepOf(result);
  }
  return scene;
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
  state.generation = text::IntegerFromJson<std::uint64_t>(json.at("generation"));
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
  if (const Json& scene = json.at("scene"); !scene.is_null()) state.scene = SceneOf(scene);
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
                     {"generation", state.generation},
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
                     {"scene", state.scene ? SceneJson(*state.scene) : Json(nullptr)},
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
