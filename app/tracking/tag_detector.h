// Square tags in a grey image: found, read, and their corners measured.
#pragma once

#include <optional>
#include <vector>

#include "app/tracking/corner_refinement.h"
#include "app/tracking/tag_family.h"
#include "app/tracking/threshold.h"

namespace plumbline {

/// One tag in one image.
struct SeenTag {
  int id = 0;
  int wrong_bits = 0;            ///< cells that had to be put right
  Corners corners_px;            ///< from the tag's own top left, clockwise as seen upright
  CornersCovariance covariance;  ///< of the corners, by the image's noise [px^2]
  double contrast = 0;           ///< bright less dark [grey levels]
};

/// How tags are looked for.
struct DetectorSettings {
  std::optional<int> threshold = {};  ///< fixed, 0..255; nothing: by the light around each place
  bool small_tags = false;  ///< the whole image also at full size: down to 18 px, 5x the time
  int most_regions = 1500;  ///< dark regions that are looked at; bounds the time of any frame
};

/// What one image showed.
struct SeenTags {
  std::vector<SeenTag> tags;
  bool limited = false;  ///< more dark regions than most_regions: the smaller ones were left out
};

/// Finds tags: dark regions -> quadrilaterals -> their edges -> their cells -> their corners.
/// Keeps its working memory from frame to frame; one detector a thread.
class TagDetector {
 public:
  TagDetector(TagFamily family, const DetectorSettings& settings);

  /// Looks at the whole image. @param lens  null where it is not known; see RefineCorners
  void Detect(const LumaView& image, const Lens* lens, SeenTags& seen);

  /// Looks at parts of it, each with its own shrink.
  struct Part {
    ImageBox box;
    int shrink = 2;
  };
  void DetectIn(const LumaView& image, const std::vector<Part>& parts, const Lens* lens,
                SeenTags& seen);

  const TagFamily& family() const { return family_; }

 private:
  void Search(const LumaView& image, const Part& part, bool whole, const Lens* lens,
              SeenTags& seen);

  TagFamily family_;
  DetectorSettings settings_;
  Threshold threshold_;
  SearchImage search_;
  QuadFinder quads_;
  std::vector<Corners> found_;
};

}  // namespace plumbline
