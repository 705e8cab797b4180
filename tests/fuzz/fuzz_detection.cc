// Fuzzer: arbitrary pixels searched for boards of all kinds and for tags: detections lie in the
// image.
#include <array>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "app/vision/lens/board_detection.h"
#include "app/vision/tracking/tag_detector.h"

namespace {

using namespace plumbline;  // NOLINT(google-build-using-namespace)

constexpr std::size_t kHeader = 4;
constexpr int kSide = 384;  // larger images are slower without new cases

void Require(bool condition) {
  if (!condition) std::abort();
}

bool Inside(const lens::Vec2& p, const image::LumaView& image) {
  return p.x() > -1 && p.y() > -1 && p.x() < image.width && p.y() < image.height;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::array<target::Board, 4> boards = {{
      {4, 3, 0.010, target::BoardKind::kChessboard, 0, {}},
      {4, 3, 0.020, target::BoardKind::kCharuco, 0.015, "aruco-4x4-50"},
      {4, 3, 0.020, target::BoardKind::kCircles, 0.012, {}},
      {3, 5, 0.020, target::BoardKind::kAsymmetricCircles, 0.015, {}},
  }};
  static const target::TagFamily family = target::TagFamilyOfName("aruco-4x4-50").value();
  if (size <= kHeader) return 0;
  // Each input byte becomes a square of pixels.
  const int columns = 1 + data[1] % 96, rows = 1 + data[2] % 96, enlarged = 1 + data[3] % 16;
  const image::LumaView image_size{nullptr, std::min(kSide, columns * enlarged),
                                   std::min(kSide, rows * enlarged), 0};
  std::vector<std::uint8_t> pixels;
  for (int v = 0; v < image_size.height; ++v) {
    for (int u = 0; u < image_size.width; ++u) {
      const auto at = static_cast<std::size_t>(v / enlarged * columns + u / enlarged);
      pixels.push_back(data[kHeader + at % (size - kHeader)]);
    }
  }
  const image::LumaView image{pixels.data(), image_size.width, image_size.height, image_size.width};
  if (data[0] % 5 < 4) {
    const target::Board& board = boards[data[0] % 5];
    const auto view = vision::DetectBoard(image, board);
    if (!view) {
      Require(!view.error().empty());
      return 0;
    }
    Require(view->corners_px.size() == static_cast<std::size_t>(board.corners()));
    Require(view->seen.size() == view->corners_px.size() && view->blur_px >= 0);
    for (std::size_t k = 0; k < view->seen.size(); ++k) {
      Require(!view->seen[k] || Inside(view->corners_px[k], image));
    }
    return 0;
  }
  static vision::TagDetector detector(family, {});
  vision::SeenTags seen;
  detector.Detect(image, nullptr, seen);
  for (const vision::SeenTag& tag : seen.tags) {
    Require(tag.id >= 0 && static_cast<std::size_t>(tag.id) < family.codes.size());
    Require(tag.covariance.allFinite());
    for (const lens::Vec2& corner : tag.corners_px) Require(Inside(corner, image));
  }
  return 0;
}
