// Consequences of one reference-tag check for the active lens.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "app/base/target/declared_facts.h"
#include "app/vision/camera/reference_tags.h"

namespace plumbline::vision {

/// The lens used to evaluate frames.
struct ActiveLens {
  lens::KnownLens known;
  std::int64_t id = 0;        ///< in the lens store; 0: not stored
  bool calibrated = false;    ///< at this zoom; if false, interpolated: only a starting point
  double log_focal_sd = 0;    ///< of ln f, for an interpolated lens
  bool contradicted = false;  ///< the tags have contradicted this calibration since it was accepted
  target::DeclaredFacts declared{};         ///< on which its uncertainty rests
  std::optional<std::int32_t> band_counts;  ///< zoom range within which this lens is valid
};

struct TagCheck {
  TagTestOutcome verdict = TagTestOutcome::kNotVisible;
  std::string message;                  ///< for the log; empty if nothing is new
  std::optional<lens::KnownLens> lens;  ///< replaces the active lens
  std::optional<TagBaseline> baseline;  ///< replaces the previous baseline
  std::vector<int> excluded;            ///< tags that contradict the others
  std::vector<int> unresolved;          ///< tags that contradict each other without a majority
  bool all_turned = false;              ///< see TagTestResult
};

/// Judges the reference tags and prepares the consequences: a drifted lens is refined, the pose of
/// a moved camera is solved again, and an interpolated lens takes its focal length from the tags;
/// that lens is good only if its projection uncertainty is then at most `acceptable_px` (1 sd, at
/// infinity, worst position in the image).
/// @param baseline  of this lens; null if there is none
TagCheck CheckReferenceTags(const ActiveLens& lens, const TagBaseline* baseline,
                            const target::Body& cell, const std::vector<SeenTag>& seen,
                            double acceptable_px, const TagCheckSettings& settings = {});

}  // namespace plumbline::vision
