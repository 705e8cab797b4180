// One look at the fixed marks with the lens in use: what it means for the lens.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "app/camera/fixed_marks.h"

namespace plumbline {

/// The lens that frames are computed with.
struct LensInUse {
  KnownLens known;
  std::int64_t id = 0;                      ///< of the store; 0: not kept
  bool calibrated = false;                  ///< at this zoom; else interpolated, and only a start
  double log_focal_sd = 0;                  ///< of an interpolated one: of ln f
  std::optional<std::int32_t> band_counts;  ///< within which it is the same lens
};

struct MarksLook {
  MarksVerdict verdict = MarksVerdict::kNotVisible;
  std::string words;                  ///< what a person should know; empty: nothing new
  std::optional<KnownLens> lens;      ///< takes the place of the one in use
  std::optional<MarksMemory> memory;  ///< takes the place of the former
  std::vector<int> left_out;
};

/// Judges the marks and prepares what follows: a drifted lens is refined, a moved camera's pose
/// solved anew, an interpolated lens gets its focal length from the marks and is good only where
/// its projection is then certain to `acceptable_px` (one deviation, at infinity, over the image).
/// @param memory  of this lens; null where there is none
MarksLook LookAtMarks(const LensInUse& lens, const MarksMemory* memory, const Body& cell,
                      const std::vector<SeenTag>& seen, double acceptable_px,
                      const MarkSettings& settings = {});

}  // namespace plumbline
