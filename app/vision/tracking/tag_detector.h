// Detector of square tags: finds and decodes tags in a grey image and measures their corners.
#pragma once

#include <optional>
#include <vector>

#include "app/base/target/tag_family.h"
#include "app/vision/tracking/corner_refinement.h"
#include "app/vision/tracking/edge_segments.h"
#include "app/vision/tracking/line_quads.h"
#include "app/vision/tracking/threshold.h"

namespace plumbline::vision {

/// A detected tag.
struct SeenTag {
  int id = 0;
  int wrong_bits = 0;            ///< cells that were corrected
  Corners corners_px;            ///< clockwise from the tag's own top left
  CornersCovariance covariance;  ///< of the corners, from image noise [px^2]
  double contrast = 0;           ///< bright minus dark [grey levels]
};

/// Renumbers the corners of a tag whose print is rotated clockwise by `quarters` quarter turns, so
/// that the first corner is again the top left one of the print.
SeenTag Turned(const SeenTag& tag, int quarters);

struct DetectorSettings {
  std::optional<int> threshold = {};  ///< fixed, 0..255; adaptive if nullopt
  bool small_tags = true;  ///< also search at full resolution: down to 14 px, twice the time
  /// Demand a clean print of families in which random cells often match (TagFamily::strict). Not
  /// needed where the layout of the tags is known, as on a board.
  bool strict = false;
  int max_regions = 1500;  ///< limit on dark regions examined; bounds the time per frame
};

struct SeenTags {
  std::vector<SeenTag> tags;
  bool limited = false;  ///< more than max_regions dark regions: the smaller ones were skipped
};

/// Also reads tags with a border of two cells, as calibration boards of Kalibr have (and OpenCV's
/// with borderBits = 2), of families in which random cells seldom match; the side of a tag is that
/// of its black square in any case. Pipeline: dark regions and edge segments -> quadrilaterals ->
/// edges -> cells -> refined corners. Reuses its buffers; use one detector per thread.
class TagDetector {
 public:
  TagDetector(target::TagFamily family, const DetectorSettings& settings);

  /// Searches the whole image. @param lens  null if unknown; see RefineCorners
  void Detect(const image::LumaView& image, const lens::Lens* lens, SeenTags& seen);

  /// A part of the image to search, and how it is prepared.
  struct Part {
    ImageBox box;
    Reduction reduction = Reduction::kHalf;
  };
  /// Searches only the given parts.
  void DetectIn(const image::LumaView& image, const std::vector<Part>& parts,
                const lens::Lens* lens, SeenTags& seen);

  const target::TagFamily& family() const { return family_; }

 private:
  struct Decoded;
  struct FoundTag {
    SeenTag tag;
    bool exact = false;  ///< its corners are refined, and no part of its border is hidden
  };
  struct Attempt {
    std::optional<FoundTag> found = {};
    bool blurred = false;  ///< a reduced image may show more
  };
  void Start(SeenTags& seen);
  void Finish(SeenTags& seen) const;
  void Search(const image::LumaView& image, const Part& part, bool whole, const lens::Lens* lens,
              SeenTags& seen);
  std::optional<Decoded> Decode(const image::LumaView& image, const Corners& corners,
                                bool blurred) const;
  void AddTags(const image::LumaView& image, const Part& part, const lens::Lens* lens);
  std::optional<FoundTag> TagAtAnyLevel(const image::LumaView& image, const Part& part,
                                        const Corners& corners, const lens::Lens* lens);
  Attempt TagAt(const image::LumaView& image, double reach_px, Corners corners,
                const lens::Lens* lens) const;

  target::TagFamily family_;
  int most_border_;  ///< widest border that is read [cells]
  DetectorSettings settings_;
  Threshold threshold_;
  SearchImage search_;
  std::array<SearchImage, 2> coarser_;  ///< search_ halved once and twice; width 0: not yet made
  QuadFinder quads_;
  EdgeSegmentFinder segment_finder_;
  std::vector<EdgeSegment> segments_;
  LineQuads line_quads_;
  std::vector<Corners> quadrilaterals_;
  QuadSet examined_;             ///< in this part
  std::vector<FoundTag> found_;  ///< in this image
};

}  // namespace plumbline::vision
