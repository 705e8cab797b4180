// Simulated observations of the cell's reference tags.
#pragma once

#include <random>

#include "app/vision/tracking/bodies.h"
#include "firmware-like/geometry/rotation.h"
#include "tests/app/vision/tracking/tag_scene.h"

namespace plumbline::test {

/// Tags of 60 mm around the field of view: 600 x 300 mm, at depths within 200 mm.
inline target::Body CellTags(int count = 5) {
  const Vec3 places[] = {{-0.30, -0.16, 0.00}, {0.30, -0.15, 0.20}, {0.29, 0.16, 0.02},
                         {-0.31, 0.15, 0.18},  {0.02, -0.17, 0.10}, {0.0, 0.17, 0.05}};
  target::Body cell{"cell", {}};
  for (int k = 0; k < count; ++k) {
    cell.tags.push_back(
        {k, 0.06, {RotationFromRollPitchYaw(Vec3(0.1 * k, -0.05 * k, 0.02 * k)), places[k]}});
  }
  return cell;
}

/// The cell 1.6 m in front of the camera, slightly rotated.
inline Pose CellInCamera() {
  return {RotationFromRollPitchYaw(Vec3(0.12, -0.08, 0.02)), Vec3(0.01, -0.02, 1.6)};
}

inline lens::Lens TagSceneLens() {
  return LensOfCamera(renderer::ZoomLens(2600));
}

/// The lens with its focal lengths larger by that share.
inline lens::Lens Zoomed(lens::Lens lens, double share) {
  lens.fx *= 1 + share;
  lens.fy *= 1 + share;
  return lens;
}

/// Tag detections with independent corner noise.
inline std::vector<vision::SeenTag> ObserveTags(const lens::Lens& lens, const target::Body& cell,
                                                const Pose& X_CK, double noise_px,
                                                std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0, noise_px);
  std::vector<vision::SeenTag> seen;
  for (const target::BodyTag& declared : cell.tags) {
    vision::SeenTag tag;
    tag.id = declared.id;
    const auto corners = vision::CornersInTag(declared.side_m);
    for (std::size_t k = 0; k < 4; ++k) {
      tag.corners_px[k] = Project<double>(lens, X_CK * (declared.X_KM * corners[k])) +
                          lens::Vec2(noise(random), noise(random));
    }
    tag.covariance = noise_px * noise_px * vision::CornersCovariance::Identity();
    seen.push_back(tag);
  }
  return seen;
}

}  // namespace plumbline::test
