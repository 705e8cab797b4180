#include "app/vision/tracking/track_json.h"

#include <fmt/format.h>

#include <cmath>

#include "app/base/text/json_text.h"
#include "app/vision/tracking/pose_json.h"
#include "firmware-like/geometry/units.h"

namespace plumbline::vision {
namespace {

using Json = nlohmann::ordered_json;

Vec3 SdOf(const Mat6& covariance, int first) {
  return covariance.diagonal().segment<3>(first).cwiseSqrt();
}

Json PoseJson(const PoseEstimate& estimate) {
  return {{"t_mm", JsonOfVector(kMmPerMetre * estimate.X_CK.p)},
          {"quaternion_wxyz", JsonOfRotation(estimate.X_CK.R)},
          {"sd",
           {{"t_mm", JsonOfVector(kMmPerMetre * SdOf(estimate.covariance, 0))},
            {"rotation_deg", JsonOfVector(SdOf(estimate.covariance, 3) / kRadPerDeg)}}}};
}

std::string PoseText(const PoseEstimate& estimate, bool ambiguous) {
  const Vec3 t = kMmPerMetre * estimate.X_CK.p, sd = kMmPerMetre * SdOf(estimate.covariance, 0);
  return fmt::format("{:10.2f} {:10.2f} {:10.2f}   {:.2f} {:.2f} {:.2f}{}", t.x(), t.y(), t.z(),
                     sd.x(), sd.y(), sd.z(), ambiguous ? "   ambiguous" : "");
}

Json FrameJson(const TrackedFrame& frame) {
  Json tags = Json::array(), bodies = Json::array();
  for (const TrackedTag& tag : frame.tags) {
    Json corners = Json::array();
    for (const lens::Vec2& corner : tag.seen.corners_px)
      corners.push_back({corner.x(), corner.y()});
    tags.push_back({{"id", tag.seen.id},
                    {"corners_px", corners},
                    {"pose", tag.estimate ? PoseJson(*tag.estimate) : Json(nullptr)},
                    {"ambiguous", tag.ambiguous}});
  }
  for (const SeenBody& body : frame.bodies) {
    bodies.push_back({{"name", body.body->name},
                      {"pose", PoseJson(body.estimate)},
                      {"ambiguous", body.ambiguous},
                      {"tags", body.used},
                      {"left_out", body.left_out}});
  }
  return {{"tags", tags}, {"bodies", bodies}};
}

}  // namespace

std::string TrackJson(const TrackedFrame& frame) {
  return text::JsonText(FrameJson(frame), 2) + "\n";
}

std::string TrackJsonLine(const TrackedFrame& frame, double t_s, std::uint64_t sequence) {
  Json json = {{"t_s", std::round(1e6 * t_s) / 1e6}, {"sequence", sequence}};
  json.update(FrameJson(frame));
  return text::JsonText(json) + "\n";
}

std::string TrackText(const TrackedFrame& frame) {
  if (frame.tags.empty()) return "no tags\n";
  std::string text =
      fmt::format("{:16s} {:>10s} {:>10s} {:>10s}   sd\n", "", "x mm", "y mm", "z mm");
  for (const TrackedTag& tag : frame.tags) {
    text += fmt::format("tag {:<12d} {}\n", tag.seen.id,
                        tag.estimate ? PoseText(*tag.estimate, tag.ambiguous)
                                     : std::string("no pose: size unknown, or no pose fits"));
  }
  for (const SeenBody& body : frame.bodies) {
    text += fmt::format("{:16s} {}\n", body.body->name, PoseText(body.estimate, body.ambiguous));
  }
  return text;
}

}  // namespace plumbline::vision
