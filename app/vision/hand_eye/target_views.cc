#include "app/vision/hand_eye/target_views.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "app/vision/lens/board_detection.h"
#include "drivers/camera/image_file.h"

namespace plumbline::vision {
namespace {

/// Appends the board's corners. @return the reason if it is not found, else empty
std::string AddBoard(const image::LumaView& image, const target::Board& board, HandEyeView& view) {
  const Result<BoardView> seen = DetectBoard(image, board);
  if (!seen) return seen.error();
  for (int k = 0; k < board.corners(); ++k) {
    if (!seen->seen[k]) continue;
    const lens::Vec2 corner = board.Corner(k);
    view.points_K.emplace_back(corner.x(), corner.y(), 0);
    view.pixels.push_back(seen->corners_px[k]);
  }
  return {};
}

/// Appends the corners of the body's consistent tags.
/// @return  why there are none; empty if there are some
std::string AddTags(const image::LumaView& image, const target::Body& body, const lens::Lens& lens,
                    TagDetector& detector, HandEyeView& view) {
  SeenTags seen;
  detector.Detect(image, &lens, seen);
  const auto located = LocateBody({lens}, body, seen.tags, std::nullopt);
  if (!located) return fmt::format("no tag of \"{}\"", body.name);
  for (const target::BodyTag& tag : body.tags) {
    if (std::ranges::find(located->used, tag.id) == located->used.end()) continue;
    const auto seen_tag =
        std::ranges::find_if(seen.tags, [&](const SeenTag& one) { return one.id == tag.id; });
    if (seen_tag == seen.tags.end()) continue;
    const auto corners_M = CornersInTag(tag.side_m);
    for (std::size_t k = 0; k < corners_M.size(); ++k) {
      view.points_K.push_back(tag.X_KM * corners_M[k]);
      view.pixels.push_back(seen_tag->corners_px[k]);
    }
  }
  return {};
}

constexpr std::size_t kMinPoints = 4;

/// Removes the points that lie outside the lens's usable region.
void RemoveOutside(const lens::KnownLens& lens, HandEyeView& view) {
  HandEyeView inside = view;
  inside.points_K.clear();
  inside.pixels.clear();
  for (std::size_t i = 0; i < view.pixels.size(); ++i) {
    if (!UsableAt(lens, view.pixels[i])) continue;
    inside.points_K.push_back(view.points_K[i]);
    inside.pixels.push_back(view.pixels[i]);
  }
  view = std::move(inside);
}

}  // namespace

TargetViews FindTargets(const std::string& folder, const std::vector<std::string>& names,
                        const std::map<std::string, RobotPose>& poses, const Target& target,
                        const lens::KnownLens& lens, const std::function<bool()>& interrupted) {
  TargetViews found;
  const auto refuse = [&](const std::string& name, std::string reason) {
    found.refused.push_back({name, std::move(reason)});
  };
  std::optional<TagDetector> detector;
  if (target.body != nullptr) detector.emplace(target.family, DetectorSettings{.small_tags = true});
  for (const std::string& name : names) {
    if (interrupted()) return found;
    const auto pose = poses.find(name);
    if (pose == poses.end()) {
      refuse(name, "not listed in the table of robot poses");
      continue;
    }
    const Result<camera::GreyImage> image =
        camera::ReadImage((std::filesystem::path(folder) / name).string());
    if (!image) {
      refuse(name, image.error());
      continue;
    }
    if (image->View().size() != lens.size) {
      refuse(name, fmt::format("{} x {} px, but the lens was calibrated at {} x {}", image->width,
                               image->height, lens.size.width, lens.size.height));
      continue;
    }
    HandEyeView view;
    view.name = name;
    view.X_BF = pose->second.X_BF;
    view.q = pose->second.q;
    const std::string why = target.body == nullptr
                                ? AddBoard(image->View(), target.board, view)
                                : AddTags(image->View(), *target.body, lens.lens, *detector, view);
    if (!why.empty()) {
      refuse(name, why);
      continue;
    }
    RemoveOutside(lens, view);
    if (view.pixels.size() < kMinPoints) {
      refuse(name, "the target lies outside the region in which the lens is usable");
      continue;
    }
    found.views.push_back(std::move(view));
  }
  for (const auto& [name, pose] : poses) {
    if (std::ranges::find(names, name) == names.end()) refuse(name, "there is no such image");
  }
  return found;
}

}  // namespace plumbline::vision
