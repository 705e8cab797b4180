#include "app/cell/view_link/camera_json.h"

#include <array>

#include "firmware-like/lens/known_lens.h"

namespace plumbline::cell {
namespace {

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

}  // namespace

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

}  // namespace plumbline::cell
