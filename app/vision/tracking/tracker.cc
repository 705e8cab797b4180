#include "app/vision/tracking/tracker.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace plumbline::vision {
namespace {

constexpr double kSmallTag_px = 60;  // smaller tags are searched at full resolution
constexpr double kTinyTag_px = 26;   // and these without smoothing
constexpr double kMinMargin_px = 12;

double LongestSide(const Corners& corners) {
  double longest = 0;
  for (int k = 0; k < 4; ++k) {
    longest = std::max(longest, (corners[(k + 1) % 4] - corners[k]).norm());
  }
  return longest;
}

ImageBox BoxAround(const Corners& corners, double margin) {
  lens::Vec2 low = corners[0], high = corners[0];
  for (const lens::Vec2& corner : corners) low = low.cwiseMin(corner), high = high.cwiseMax(corner);
  // Clamped to avoid integer overflow far outside of the image.
  const auto whole = [](double value) {
    return static_cast<int>(std::clamp(std::floor(value), -1e6, 1e6));
  };
  return {whole(low.x() - margin), whole(low.y() - margin), whole(high.x() + margin) + 1,
          whole(high.y() + margin) + 1};
}

/// A tracker looks for single tags anywhere in the image.
DetectorSettings Strict(DetectorSettings settings) {
  settings.strict = true;
  return settings;
}

lens::Vec2 CentreOf(const Corners& corners) {
  return 0.25 * (corners[0] + corners[1] + corners[2] + corners[3]);
}

}  // namespace

bool InUsableRegion(const lens::KnownLens& lens, const SeenTag& tag) {
  return std::ranges::all_of(tag.corners_px,
                             [&](const lens::Vec2& corner) { return UsableAt(lens, corner); });
}

Tracker::Tracker(target::TagFamily family, target::TagDatabase database,
                 const TrackerSettings& settings)
    : database_(std::move(database)),
      settings_(settings),
      detector_(std::move(family), Strict(settings.detector)) {}

void Tracker::Forget() {
  tracks_.clear();
  last_tag_.clear();
  last_body_.clear();
}

Corners Tracker::Predicted(const Track& track, double time_s) const {
  Corners corners = track.corners;
  for (int k = 0; k < 4; ++k) corners[k] += (time_s - track.time_s) * track.velocity[k];
  return corners;
}

bool Tracker::SearchPredicted(const image::LumaView& image, double time_s, const lens::Lens* lens) {
  parts_.clear();
  for (const Track& track : tracks_) {
    const Corners corners = Predicted(track, time_s);
    const double side = LongestSide(corners);
    const double moved = (CentreOf(corners) - CentreOf(track.corners)).norm();
    const double margin = std::max(kMinMargin_px, 0.5 * side) + 0.5 * moved;
    parts_.push_back({BoxAround(corners, margin), side < kTinyTag_px    ? Reduction::kNone
                                                  : side < kSmallTag_px ? Reduction::kSmooth
                                                                        : Reduction::kHalf});
  }
  detector_.DetectIn(image, parts_, lens, seen_);
  return std::ranges::all_of(tracks_, [&](const Track& track) {
    return std::ranges::any_of(seen_.tags, [&](const SeenTag& tag) { return tag.id == track.id; });
  });
}

/// Orders the corners of tags that OpenCV drew as those drawings are upright.
void Tracker::ApplyPrintOrigins() {
  if (!target::OpenCvTurns(detector_.family())) return;
  for (SeenTag& tag : seen_.tags) {
    const target::DrawnBy drawn_by = database_.DrawnByOf(tag.id);
    if (drawn_by == target::DrawnBy::kOpenCv ||
        (drawn_by == target::DrawnBy::kUnspecified && opencv_prints_)) {
      tag = Turned(tag, 2);
    }
  }
}

void Tracker::UpdateTracks(double time_s) {
  std::vector<Track> tracks;
  for (const SeenTag& tag : seen_.tags) {
    Track track{tag.id, tag.corners_px, {}, time_s};
    track.velocity.fill(lens::Vec2::Zero());
    // If an id is visible twice, each tag continues the nearer track.
    const Track* before = nullptr;
    double nearest = 2 * LongestSide(tag.corners_px);
    for (const Track& old : tracks_) {
      const double far = (CentreOf(Predicted(old, time_s)) - CentreOf(tag.corners_px)).norm();
      if (old.id == tag.id && far < nearest) nearest = far, before = &old;
    }
    if (before != nullptr && time_s > before->time_s) {
      for (int k = 0; k < 4; ++k) {
        track.velocity[k] = (tag.corners_px[k] - before->corners[k]) / (time_s - before->time_s);
      }
    }
    tracks.push_back(track);
  }
  tracks_ = std::move(tracks);
}

void Tracker::LocateTag(TrackedTag& tag, double time_s, const lens::KnownLens& lens) {
  const auto poses = PosesOfTag(lens, tag.seen.corners_px, tag.seen.covariance, tag.side_m);
  if (!poses) return;
  tag.estimate = poses->best;
  tag.ambiguous = poses->ambiguous();
  const int id = tag.seen.id;
  std::optional<PastPose> guide;
  const target::Body* body = database_.BodyOf(id);
  for (const SeenBody& seen : frame_.bodies) {
    if (seen.body != body || !std::binary_search(seen.used.begin(), seen.used.end(), id)) continue;
    for (const target::BodyTag& on_body : body->tags) {
      if (on_body.id != id) continue;
      guide = PastPose{seen.estimate.X_CK * on_body.X_KM, seen.ambiguous, time_s};
    }
  }
  const auto last = last_tag_.find(id);
  if (!guide && last != last_tag_.end() &&
      time_s - last->second.time_s <= settings_.pose_memory_s) {
    guide = last->second;
  }
  if (tag.ambiguous && guide) {
    const bool flipped =
        AngleBetween(poses->other->X_CK, guide->X) < AngleBetween(poses->best.X_CK, guide->X);
    if (flipped) tag.estimate = poses->other;
    tag.ambiguous = guide->ambiguous;
  }
  last_tag_[id] = {tag.estimate->X_CK, tag.ambiguous, time_s};
}

void Tracker::Locate(double time_s, const lens::KnownLens& lens) {
  std::vector<SeenTag> tags = seen_.tags;
  std::erase_if(tags, [&](const SeenTag& tag) {
    return std::ranges::find(set_aside_, tag.id) != set_aside_.end() || !InUsableRegion(lens, tag);
  });
  for (const target::Body& body : database_.bodies) {
    std::optional<Pose> previous;
    const auto last = last_body_.find(body.name);
    const bool recent =
        last != last_body_.end() && time_s - last->second.time_s <= settings_.pose_memory_s;
    if (recent) previous = last->second.X;
    auto seen = LocateBody(lens, body, tags, previous);
    if (!seen) continue;
    if (seen->ambiguous && recent) seen->ambiguous = last->second.ambiguous;
    last_body_[body.name] = {seen->estimate.X_CK, seen->ambiguous, time_s};
    frame_.bodies.push_back(std::move(*seen));
  }
  for (TrackedTag& tag : frame_.tags) {
    if (tag.side_m > 0 && InUsableRegion(lens, tag.seen)) LocateTag(tag, time_s, lens);
  }
}

const TrackedFrame& Tracker::Update(const image::LumaView& image, double time_s,
                                    const lens::KnownLens* lens) {
  const lens::Lens* const known = lens != nullptr ? &lens->lens : nullptr;
  const bool due = tracks_.empty() || ++frames_since_full_search_ >= settings_.full_search_interval;
  frame_ = {};
  frame_.full_search = due || !SearchPredicted(image, time_s, known);
  if (frame_.full_search) {
    detector_.Detect(image, known, seen_);
    frames_since_full_search_ = 0;
  }
  frame_.limited = seen_.limited;
  ApplyPrintOrigins();
  UpdateTracks(time_s);
  for (const SeenTag& tag : seen_.tags) {
    frame_.tags.push_back({tag, database_.SideOf(tag.id).value_or(0), std::nullopt, false});
  }
  if (lens != nullptr) Locate(time_s, *lens);
  return frame_;
}

}  // namespace plumbline::vision
