#include "app/vision/camera/tag_check.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>

#include "app/base/text/text.h"
#include "app/vision/lens/projection_uncertainty.h"
#include "firmware-like/geometry/units.h"

namespace plumbline::vision {
namespace {

std::string ExclusionMessage(const TagTestResult& judgement) {
  const std::vector<int>& ids = judgement.excluded;
  if (ids.empty()) return {};
  std::string message = fmt::format("reference tag {} {} not where the other tags imply",
                                    fmt::join(ids, ", "), ids.size() == 1 ? "is" : "are");
  for (const auto& [id, quarters] : judgement.quarter_turns) {
    message += fmt::format(
        "; tag {} is turned by {} deg{}", id, 90 * quarters,
        quarters == 2 ? ", as if OpenCV had drawn it: turn it, or set its drawn_by" : ": turn it");
  }
  return message + fmt::format("; {} set aside: put {} back, or measure {} again",
                               ids.size() == 1 ? "it is" : "they are",
                               ids.size() == 1 ? "it" : "them",
                               ids.size() == 1 ? "its place" : "their places");
}

/// Copies what both kinds of check report alike.
TagCheck CheckFrom(const TagTestResult& judgement) {
  TagCheck check;
  check.verdict = judgement.verdict;
  check.excluded = judgement.excluded;
  check.unresolved = judgement.unresolved;
  check.all_turned = judgement.all_turned;
  if (judgement.all_turned) {
    check.message = "every reference tag is turned by half a turn against its declaration";
  }
  return check;
}

/// Tests a calibrated lens as it is, an interpolated one with its focal length refined.
TagCheck CheckWithoutBaseline(const ActiveLens& lens, const target::Body& cell,
                              const std::vector<SeenTag>& seen, double acceptable_px,
                              const TagCheckSettings& settings) {
  TagCheck check;
  lens::KnownLens used = lens.known;
  if (!lens.calibrated) {
    const auto refined = RefineFocalLength(lens.known, lens.log_focal_sd, cell, seen, settings);
    if (!refined) return check;
    used = *refined;
  }
  const TagTestResult judgement = TestReferenceTags(used, cell, seen, nullptr, settings);
  check = CheckFrom(judgement);
  if (judgement.verdict == TagTestOutcome::kBad && !judgement.all_turned) {
    check.message = fmt::format(
        "the reference tags do not fit the lens: {:.2f} px, chi^2 {:.0f} with {} degrees of "
        "freedom",
        judgement.rms_px, judgement.chi2, judgement.degrees_of_freedom);
  }
  if (judgement.verdict != TagTestOutcome::kGood) return check;
  if (!lens.calibrated) {
    const double uncertain_px = ProjectionUncertaintyOf(used.lens, used.covariance, used.size,
                                                        std::nullopt, used.usable_radius_px)
                                    .max_px;
    if (uncertain_px > acceptable_px) {
      check.verdict = TagTestOutcome::kBad;
      check.message = fmt::format(
          "the lens is interpolated, and its projection uncertainty of {:.2g} px exceeds the "
          "limit of {:.2g} px",
          uncertain_px, acceptable_px);
      return check;
    }
    check.lens = used;
    check.message =
        fmt::format("interpolated lens in use; its focal length is {:.1f} px by the reference tags",
                    used.lens.fx);
  }
  if (!judgement.excluded.empty()) check.message = ExclusionMessage(judgement);
  check.baseline = BaselineAt(used, cell, seen, judgement.X_CK);
  for (const int id : judgement.excluded) check.baseline->tags.erase(id);
  return check;
}

}  // namespace

TagCheck CheckReferenceTags(const ActiveLens& lens, const TagBaseline* baseline,
                            const target::Body& cell, const std::vector<SeenTag>& seen,
                            double acceptable_px, const TagCheckSettings& settings) {
  if (baseline == nullptr) return CheckWithoutBaseline(lens, cell, seen, acceptable_px, settings);
  const TagTestResult judgement = TestReferenceTags(lens.known, cell, seen, baseline, settings);
  TagCheck check = CheckFrom(judgement);
  switch (judgement.verdict) {
    case TagTestOutcome::kNotVisible:
      break;
    case TagTestOutcome::kGood:
      check.message = ExclusionMessage(judgement);
      break;
    case TagTestOutcome::kCameraMoved:
      check.baseline = BaselineAt(lens.known, cell, seen, judgement.X_CK);
      check.message = fmt::format(
          "the camera was moved by {:.1f} mm and {:.2f} deg; its pose was solved again, the lens "
          "remains valid",
          1e3 * judgement.moved_m, kDegPerRad * judgement.turned_rad);
      break;
    case TagTestOutcome::kZoomDrifted: {
      const lens::KnownLens drifted =
          WithFocalDrift(lens.known, judgement.log_focal, judgement.log_focal_sd);
      const double uncertain_px =
          ProjectionUncertaintyOf(drifted.lens, drifted.covariance, drifted.size, std::nullopt,
                                  drifted.usable_radius_px)
              .max_px;
      if (uncertain_px > acceptable_px) {
        check.verdict = TagTestOutcome::kBad;
        check.message = fmt::format(
            "the zoom drifted by {:.2f} %, but the reference tags determine it only to {:.2f} %",
            100 * std::expm1(judgement.log_focal), 100 * judgement.log_focal_sd);
        break;
      }
      check.lens = drifted;
      check.baseline = BaselineAt(drifted, cell, seen, baseline->X_CK);
      const int decimals = text::DecimalsFor({100 * judgement.log_focal_sd}, 3);
      check.message = fmt::format(
          "the zoom drifted: focal length {:+.{}f} % +- {:.{}f} % (1 sd), refined",
          100 * std::expm1(judgement.log_focal), decimals, 100 * judgement.log_focal_sd, decimals);
      break;
    }
    case TagTestOutcome::kBad:
      if (judgement.all_turned) break;
      check.message = fmt::format(
          "the reference tags are off by {:.2f} px, which neither a drift of the zoom nor a moved "
          "camera explains (chi^2 {:.0f} with {} degrees of freedom)",
          judgement.rms_px, judgement.chi2, judgement.degrees_of_freedom);
      break;
  }
  return check;
}

}  // namespace plumbline::vision
