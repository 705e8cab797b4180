#include "app/cell/view_link/view_json.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <concepts>
#include <limits>

#include "app/base/text/json_integer.h"
#include "app/base/text/json_text.h"
#include "app/cell/view_link/json_values.h"
#include "app/cell/view_link/view_state.h"
#include "firmware-like/lens/known_lens.h"

namespace plumbline::cell {
namespace {

constexpr int kMaxSlots = 16, kMaxSide_px = 16384;
constexpr std::size_t kMaxListSize = 8192;

// Fields of each struct with their names in JSON, for writing and reading alike. `field` is called
// with the name and the member of each.

template <typename T, typename Plain>
concept Is = std::same_as<std::remove_const_t<T>, Plain>;

/// The used part of an array.
template <typename Array, typename Count>
struct Counted {
  Array& values;
  Count& count;
};
template <typename Array, typename Count>
Counted(Array&, Count&) -> Counted<Array, Count>;  // clang 14 deduces none for an aggregate

void VisitFields(Is<ViewImage> auto& image, auto&& field) {
  field("slot", image.slot);
  field("stamp", image.stamp);
  field("width", image.width);
  field("height", image.height);
  field("colour", image.colour);
  field("time_s", image.time_s);
  field("sequence", image.sequence);
}

void VisitFields(Is<status::CameraStatus> auto& status, auto&& field) {
  field("configured", status.configured);
  field("name", status.name);
  field("state", status.state);
  field("reason", status.reason);
  field("prompt", status.prompt);
  field("board_views", status.board_views);
  field("zoom_counts", status.zoom_counts);
  field("focus_counts", status.focus_counts);
  field("lens_id", status.lens_id);
  field("zoom_time_s", status.zoom_time_s);
  field("frame_time_s", status.frame_time_s);
  field("tip_W_m", status.tip_W);
  field("tip_covariance_W_m2", status.tip_covariance_W);
  field("tip_tag_covariance_W_m2", status.tip_tag_covariance_W);
  field("tip_time_s", status.tip_time_s);
  field("lens_stale", status.lens_stale);
  field("camera_lost", status.camera_lost);
  field("zoom_unknown", status.zoom_unknown);
  field("board_wanted", status.board_wanted);
  field("fiducials_hidden", status.fiducials_hidden);
  field("fiducial_moved", status.fiducial_moved);
  field("store_fault", status.store_fault);
  field("opencv_prints", status.opencv_prints);
  field("rests_on_no_window", status.rests_on_no_window);
  field("rests_on_fixed_focus", status.rests_on_fixed_focus);
  field("tip_valid", status.tip_valid);
  field("contradicting_tags", Counted{status.contradicting_tags, status.contradicting_count});
}

void VisitFields(Is<ViewTag> auto& tag, auto&& field) {
  field("id", tag.id);
  field("corners_px", tag.corners_px);
  field("X_CM", tag.X_CM);
  field("ambiguous", tag.ambiguous);
}

void VisitFields(Is<ViewBody> auto& body, auto&& field) {
  field("name", body.name);
  field("X_CK", body.X_CK);
  field("ambiguous", body.ambiguous);
}

void VisitFields(Is<lens::BoardGuidance> auto& guidance, auto&& field) {
  field("wanted_px", guidance.wanted_px);
  field("seen_px", guidance.seen_px);
  field("met", guidance.met);
  field("views", guidance.views);
  field("expected_views", guidance.expected_views);
  field("columns", guidance.columns);
  field("rows", guidance.rows);
  field("uncertainty", guidance.uncertainty);
}

void VisitFields(Is<ViewCamera> auto& camera, auto&& field) {
  field("status", camera.status);
  field("serial", camera.serial);
  field("mode", camera.mode);
  field("image", camera.image);
  field("lens", camera.lens);
  field("usable_radius_px", camera.usable_radius_px);
  field("tags", camera.tags);
  field("bodies", camera.bodies);
  field("guidance", camera.guidance);
}

void VisitFields(Is<ViewPoint> auto& point, auto&& field) {
  field("id", point.id);
  field("valid", point.valid);
  field("extrapolated", point.extrapolated);
  field("code", point.code);
  field("X_BP_command", point.X_BP_command);
  field("translation_B_m", point.translation_B);
  field("uncertainty_m", point.uncertainty_m);
  field("basis", point.basis);
  field("q", point.q);
  field("taught", point.taught);
  field("differs", point.differs);
}

void VisitFields(Is<ViewMotion> auto& motion, auto&& field) {
  field("state", motion.state);
  field("age_s", motion.age_s);
  field("sag", motion.sag);
  field("acceleration_F", motion.acceleration_F);
  field("angular_acceleration_F", motion.angular_acceleration_F);
  field("tip_acceleration", motion.tip_acceleration);
  field("tip_W_m", motion.tip_W);
  field("radius_m", motion.radius_m);
}

void VisitFields(Is<status::MonitoringStatus> auto& status, auto&& field) {
  field("applied", status.model.applied);
  field("proposed", status.model.proposed);
  field("declared", status.model.declared);
  field("probes", status.probes);
  field("quarantined", status.quarantined);
  field("reference_learned", status.reference_learned);
  field("reference_wanted", status.reference_wanted);
  field("drift_statistic", status.drift_statistic);
  field("residual_m", status.residual_m);
  field("recording", status.recording);
  field("drift_alarm", status.drift_alarm);
  field("learning", status.learning);
  field("reference_refused", status.reference_refused);
  field("radius_contradicted", status.radius_contradicted);
  field("diagnosing", status.diagnosing);
  field("fault", status.fault);
  field("storage_unavailable", status.storage_unavailable);
}

void VisitFields(Is<ViewCycle> auto& cycle, auto&& field) {
  field("uptime_s", cycle.uptime_s);
  field("longest_s", cycle.longest_s);
  field("cycles", cycle.cycles);
  field("late", cycle.late);
  field("starts", cycle.starts.counts);
  field("starts_sum_s", cycle.starts.sum_s);
}

void VisitFields(Is<ViewLine> auto& line, auto&& field) {
  field("number", line.number);
  field("utc_s", line.utc_s);
  field("level", line.level);
  field("text", line.text);
}

void VisitFields(Is<Separation> auto& between, auto&& field) {
  field("touching", between.touching);
  field("inside", between.inside);
  field("distance_m", between.distance_m);
  field("p_a_W_m", between.p_a_W);
  field("p_b_W_m", between.p_b_W);
  field("depth_m", between.depth_m);
  field("penetration_direction_W", between.penetration_direction_W);
}

void VisitFields(Is<MeasuredPair> auto& pair, auto&& field) {
  field("a", pair.a);
  field("b", pair.b);
  field("number_a", pair.number_a);
  field("number_b", pair.number_b);
  field("state", pair.state);
  field("separation", pair.separation);
}

void VisitFields(Is<MeasuredDistance> auto& distance, auto&& field) {
  field("name", distance.name);
  field("distance_m", distance.distance_m);
  field("p_a_W_m", distance.p_a_W);
  field("p_b_W_m", distance.p_b_W);
}

void VisitFields(Is<PlacedPoint> auto& point, auto&& field) {
  field("name", point.name);
  field("p_W_m", point.p_W);
}

/// Without `other`, an index that means nothing to the viewer.
void VisitFields(Is<SweepResult> auto& sweep, auto&& field) {
  field("hits", sweep.hits);
  field("travelled_m", sweep.travelled_m);
  field("least_m", sweep.least_m);
  field("p_W_m", sweep.p_W);
}

void VisitFields(Is<MeasuredSweep> auto& sweep, auto&& field) {
  field("name", sweep.name);
  field("other", sweep.other);
  field("result", sweep.result);
}

void VisitFields(Is<SceneMeasurements> auto& scene, auto&& field) {
  field("time_s", scene.time_s);
  field("took_s", scene.took_s);
  field("pairs", scene.pairs);
  field("distances", scene.distances);
  field("points", scene.points);
  field("sweeps", scene.sweeps);
}

/// All but the points, which are sent separately.
void VisitFields(Is<ViewState> auto& state, auto&& field) {
  field("now_s", state.now_s);
  field("utc_s", state.utc_s);
  field("version", state.version);
  field("cell", state.cell);
  field("generation", state.generation);
  field("model_version", state.model_version);
  field("status", state.status);
  field("alarms", state.alarms);
  field("warnings", state.warnings);
  field("health", state.health.reason);
  field("data_age_s", state.data_age_s);
  field("cycle", state.cycle);
  field("q", state.q);
  field("motion", state.motion);
  field("payload_kg", state.payload_kg);
  field("payload_cog_F_m", state.payload_cog_F);
  field("payload_problem", state.payload_problem);
  field("payload_remedy", state.payload_remedy);
  field("robot_problem", state.robot_problem);
  field("robot_remedy", state.robot_remedy);
  field("tool", state.tool);
  field("temp_C", state.temp_C);
  field("monitoring", state.monitoring);
  field("cameras", state.cameras);
  field("scene", state.scene);
  field("lines", state.lines);
}

template <typename T>
concept Described = requires(T& value) {
  VisitFields(value, [](const char*, auto&&) {});
};
template <typename T>
concept Optional = requires(T& value) {
  value.has_value();
};
template <typename T>
concept List = requires(T& value) {
  typename T::value_type;
  value.data();
}
&&!std::same_as<T, std::string>;

constexpr auto LastOf(status::CameraName) {
  return status::CameraName::kTop;
}
constexpr auto LastOf(lens::ZoomState) {
  return lens::ZoomState::kRefused;
}
constexpr auto LastOf(lens::ZoomReason) {
  return lens::kLastZoomReason;
}
constexpr auto LastOf(lens::BoardPrompt) {
  return lens::BoardPrompt::kCounterclockwise;
}
constexpr auto LastOf(correction::CorrectionCode) {
  return correction::kLastCorrectionCode;
}
constexpr auto LastOf(model::RadiusBasis) {
  return model::RadiusBasis::kMeasured;
}
constexpr auto LastOf(motion::MotionState) {
  return motion::MotionState::kLoadUnknown;
}
constexpr auto LastOf(scene::Proximity) {
  return scene::Proximity::kInterference;
}
constexpr auto LastOf(HealthReason) {
  return kLastHealthReason;
}

template <typename T>
Json JsonOf(const T& value) {
  if constexpr (Described<T>) {
    Json json;
    VisitFields(value, [&](const char* name, const auto& member) { json[name] = JsonOf(member); });
    return json;
  } else if constexpr (Optional<T>) {
    return value ? JsonOf(*value) : Json(nullptr);
  } else if constexpr (std::is_enum_v<T>) {
    return static_cast<int>(value);
  } else if constexpr (std::floating_point<T>) {
    return NumberJson(value);
  } else if constexpr (std::same_as<T, Pose>) {
    return PoseJson(value);
  } else if constexpr (std::same_as<T, lens::Lens>) {
    return {{"values", VectorJson(lens::VectorOfLens(value))}, {"fisheye", value.fisheye}};
  } else if constexpr (requires { value.reshaped(); }) {
    return VectorJson(value.reshaped());
  } else if constexpr (requires { value.count; }) {
    Json list = Json::array();
    for (std::size_t k = 0; k < value.count; ++k) list.push_back(value.values[k]);
    return list;
  } else if constexpr (List<T>) {
    Json list = Json::array();
    for (const auto& entry : value) list.push_back(JsonOf(entry));
    return list;
  } else {
    return value;
  }
}

/// Checks beyond the types.
void Check(const auto&) {}

void RequireTime(double time_s) {
  if (!std::isfinite(time_s)) throw std::out_of_range("a time is missing");
}

void Check(const ViewImage& image) {
  const bool slot = image.slot >= 0 && image.slot < kMaxSlots;
  const bool size = image.width > 0 && image.width <= kMaxSide_px && image.height > 0 &&
                    image.height <= kMaxSide_px;
  if (!slot || !size) throw std::out_of_range("an image's slot or size is implausible");
  RequireTime(image.time_s);
}

void Check(const ViewLine& line) {
  RequireTime(line.utc_s);
}

void Check(const ViewCamera& camera) {
  if (camera.usable_radius_px && !(*camera.usable_radius_px > 0))
    throw std::out_of_range("usable_radius_px is not positive");
}

void Check(const lens::BoardGuidance& guidance) {
  if (guidance.uncertainty.size() != std::size_t{guidance.columns} * guidance.rows)
    throw std::out_of_range("the uncertainty is not a grid");
}

void Check(const ViewState& state) {
  if (state.cameras.size() > model::kMaxCameras) throw std::out_of_range("too many cameras");
  if (state.tool < 0 || state.tool > std::numeric_limits<std::uint16_t>::max())
    throw std::out_of_range("a tool's number is implausible");
  RequireTime(state.now_s);
  RequireTime(state.utc_s);
}

/// @param json  untrusted
/// @throws      std::exception that says which value is missing or implausible
template <typename T>
void Read(const Json& json, T& value) {
  if constexpr (Described<T>) {
    VisitFields(value, [&](const char* name, auto&& member) { Read(json.at(name), member); });
    Check(value);
  } else if constexpr (Optional<T>) {
    if (!json.is_null()) Read(json, value.emplace());
  } else if constexpr (std::is_enum_v<T>) {
    value = EnumOf(json, LastOf(T{}));
  } else if constexpr (std::same_as<T, bool> || std::same_as<T, std::string>) {
    value = json.get<T>();
  } else if constexpr (std::integral<T>) {
    value = text::IntegerFromJson<T>(json);
  } else if constexpr (std::floating_point<T>) {
    value = static_cast<T>(NumberOf(json));
  } else if constexpr (std::same_as<T, Pose>) {
    value = PoseOfJson(json);
  } else if constexpr (std::same_as<T, lens::Lens>) {
    lens::LensVector v;
    ReadVector(json.at("values"), v);
    if (!(v[0] > 0) || !(v[1] > 0)) throw std::out_of_range("a focal length is not positive");
    value = lens::LensOfVector(v, json.at("fisheye").get<bool>());
  } else if constexpr (std::same_as<T, model::JointVector>) {
    value = JointsOf(json);
  } else if constexpr (requires { value.reshaped(); }) {
    auto numbers = value.reshaped();
    ReadVector(json, numbers);
  } else if constexpr (requires { value.count; }) {
    for (const Json& entry : json) {
      if (value.count == value.values.size()) throw std::out_of_range("too long a list");
      Read(entry, value.values[value.count++]);
    }
  } else if constexpr (requires { value.emplace_back(); }) {
    if (!json.is_array() || json.size() > kMaxListSize)
      throw std::out_of_range("too long a list, or none");
    for (const Json& entry : json) Read(entry, value.emplace_back());
  } else {
    if (json.size() != value.size()) throw std::out_of_range("a list of another length");
    for (std::size_t k = 0; k < value.size(); ++k) Read(json.at(k), value[k]);
  }
}

ViewState StateOf(const Json& json) {
  if (const int schema = text::IntegerFromJson<int>(json.at("schema")); schema != kViewSchema) {
    throw std::out_of_range(fmt::format(
        "schema {} instead of {}: plumblined and this program are of different versions", schema,
        kViewSchema));
  }
  ViewState state;
  Read(json, state);
  state.health.severity = SeverityOf(state.health.reason);
  return state;
}

std::vector<ViewPoint> PointsOf(const Json& json) {
  if (!json.is_array()) throw std::out_of_range("the points are not a list");
  std::vector<ViewPoint> points(json.size());
  for (std::size_t k = 0; k < points.size(); ++k) Read(json.at(k), points[k]);
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
  Json json = {{"schema", kViewSchema}};
  VisitFields(state, [&](const char* name, const auto& member) { json[name] = JsonOf(member); });
  // The viewer needs the sum only.
  for (std::size_t k = 0; k < state.cameras.size(); ++k) {
    const status::CameraStatus& status = state.cameras[k].status;
    json["cameras"][k]["status"]["tip_covariance_W_m2"] =
        JsonOf(Mat3(status.tip_covariance_W + status.tip_tag_covariance_W));
  }
  return text::JsonText(json);
}

std::string JsonOfPoints(const std::vector<ViewPoint>& points) {
  return text::JsonText(JsonOf(points));
}

Result<ViewState> ViewOfJson(std::string_view text) {
  return Parsed(text, StateOf);
}

Result<std::vector<ViewPoint>> PointsOfJson(std::string_view text) {
  return Parsed(text, PointsOf);
}

}  // namespace plumbline::cell
