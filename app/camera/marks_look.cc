#include "app/camera/marks_look.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>

#include "app/lens/projection_uncertainty.h"
#include "app/printed_digits.h"
#include "firmware-like/geometry/angle.h"

namespace plumbline {
namespace {

std::string LeftOut(const std::vector<int>& ids) {
  if (ids.empty()) return {};
  return fmt::format("mark {} stands elsewhere than the others say; set it right, or {}",
                     fmt::join(ids, ", "), "measure its place anew");
}

/// Without memory: a calibrated lens as it is, an interpolated one refined.
MarksLook FirstLook(const LensInUse& lens, const Body& cell, const std::vector<SeenTag>& seen,
                    double acceptable_px, const MarkSettings& settings) {
  MarksLook look;
  KnownLens used = lens.known;
  if (!lens.calibrated) {
    const auto refined = RefineFocal(lens.known, lens.log_focal_sd, cell, seen, settings);
    if (!refined) return look;
    used = *refined;
  }
  const MarksJudged judged = JudgeMarks(used, cell, seen, nullptr, settings);
  look.verdict = judged.verdict;
  look.left_out = judged.left_out;
  if (judged.verdict == MarksVerdict::kBad) {
    look.words = fmt::format("the fixed marks do not fit the lens: {:.2f} px, chi^2 {:.0f} of {}",
                             judged.rms_px, judged.chi2, judged.freedom);
  }
  if (judged.verdict != MarksVerdict::kGood) return look;
  if (!lens.calibrated) {
    const double uncertain_px = UncertaintyOf(used.lens, used.covariance, used.size).max_px;
    if (uncertain_px > acceptable_px) {
      look.verdict = MarksVerdict::kBad;
      look.words = fmt::format(
          "the lens is interpolated, and uncertain by {:.2g} px where {:.2g} px is allowed",
          uncertain_px, acceptable_px);
      return look;
    }
    look.lens = used;
    look.words = fmt::format("an interpolated lens, its focal length {:.1f} px from the marks",
                             used.lens.fx);
  }
  if (!judged.left_out.empty()) look.words = LeftOut(judged.left_out);
  look.memory = Remember(used, cell, seen, judged.X_CK);
  for (const int id : judged.left_out) look.memory->tags.erase(id);
  return look;
}

}  // namespace

MarksLook LookAtMarks(const LensInUse& lens, const MarksMemory* memory, const Body& cell,
                      const std::vector<SeenTag>& seen, double acceptable_px,
                      const MarkSettings& settings) {
  if (memory == nullptr) return FirstLook(lens, cell, seen, acceptable_px, settings);
  MarksLook look;
  const MarksJudged judged = JudgeMarks(lens.known, cell, seen, memory, settings);
  look.verdict = judged.verdict;
  look.left_out = judged.left_out;
  switch (judged.verdict) {
    case MarksVerdict::kNotVisible:
      break;
    case MarksVerdict::kGood:
      look.words = LeftOut(judged.left_out);
      break;
    case MarksVerdict::kCameraMoved:
      look.memory = Remember(lens.known, cell, seen, judged.X_CK);
      look.words = fmt::format(
          "the camera was moved by {:.1f} mm and {:.2f} deg; its pose was solved anew, the lens "
          "stays",
          1e3 * judged.moved_m, kDegPerRad * judged.turned_rad);
      break;
    case MarksVerdict::kZoomDrifted: {
      const KnownLens drifted = Drifted(lens.known, judged.log_focal, judged.log_focal_sd);
      const double uncertain_px =
          UncertaintyOf(drifted.lens, drifted.covariance, drifted.size).max_px;
      if (uncertain_px > acceptable_px) {
        look.verdict = MarksVerdict::kBad;
        look.words =
            fmt::format("the zoom drifted by {:.2f} %, and the marks tell it to {:.2f} % only",
                        100 * std::expm1(judged.log_focal), 100 * judged.log_focal_sd);
        break;
      }
      look.lens = drifted;
      look.memory = Remember(drifted, cell, seen, memory->X_CK);
      const int decimals = DecimalsFor({100 * judged.log_focal_sd}, 3);
      look.words = fmt::format("the zoom drifted: focal length {:+.{}f} % +- {:.{}f} %, refined",
                               100 * std::expm1(judged.log_focal), decimals,
                               100 * judged.log_focal_sd, decimals);
      break;
    }
    case MarksVerdict::kBad:
      look.words = fmt::format(
          "the fixed marks are off by {:.2f} px, which neither a drift of the zoom nor a moved "
          "camera explains (chi^2 {:.0f} of {})",
          judged.rms_px, judged.chi2, judged.freedom);
      break;
  }
  return look;
}

}  // namespace plumbline
