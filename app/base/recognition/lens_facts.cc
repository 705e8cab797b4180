#include "app/base/recognition/lens_facts.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "app/base/recognition/kinds.h"
#include "firmware-like/lens/known_lens.h"

namespace plumbline::recognition {
namespace {

constexpr std::size_t kMostTerms = 12;  // of OpenCV, without tilt

std::string TermsText(const std::vector<double>& terms) {
  if (terms.size() > kMostTerms + 2) return fmt::format("{} terms", terms.size());
  return fmt::format("{}: {:.6g}", terms.size(), fmt::join(terms, ", "));
}

/// The lens as Plumbline computes with it; nullopt if the file does not state all of it.
std::optional<lens::KnownLens> KnownOf(const LensFacts& facts) {
  if (!facts.opencv_order || !facts.fx || !facts.fy || !facts.cx || !facts.cy || !facts.terms ||
      !facts.width || !facts.height) {
    return std::nullopt;
  }
  lens::KnownLens known;
  known.lens.fx = facts.fx->value;
  known.lens.fy = facts.fy->value;
  known.lens.cx = facts.cx->value;
  known.lens.cy = facts.cy->value;
  std::vector<double> terms = facts.terms->value;
  if (!std::ranges::all_of(terms, [](double term) { return std::isfinite(term); })) {
    return std::nullopt;
  }
  if (!facts.fisheye) {
    while (terms.size() > kMostTerms && terms.back() == 0) terms.pop_back();
    for (const std::size_t size : {std::size_t{5}, std::size_t{8}, kMostTerms}) {
      if (terms.size() <= size) {
        terms.resize(size, 0.0);
        break;
      }
    }
  }
  const bool sizes = facts.width->value >= 1 && facts.width->value <= 65536 &&
                     facts.height->value >= 1 && facts.height->value <= 65536;
  if (!(known.lens.fx > 0) || !(known.lens.fy > 0) || !sizes ||
      !lens::SetDistortion(terms, facts.fisheye, known.lens)) {
    return std::nullopt;
  }
  known.size = {static_cast<int>(facts.width->value), static_cast<int>(facts.height->value)};
  return known;
}

/// A corner of the image that no direction reaches, since the distortion folds back before it.
struct Fold {
  double at_px = 0, corner_px = 0;  ///< distances from the principal point
};

/// Follows the image of the directions towards each corner until it reaches the corner's distance:
/// up to 90 deg from the axis, those of a fisheye up to 180 deg.
std::optional<Fold> FoldOf(const lens::KnownLens& known) {
  constexpr int kSteps = 1500;  // of 90 deg
  const lens::Lens& lens = known.lens;
  const lens::Vec2 centre(lens.cx, lens.cy);
  const int steps = lens.fisheye ? 2 * kSteps : kSteps;
  std::optional<Fold> nearest;
  for (const double u : {0.0, known.size.width - 1.0}) {
    for (const double v : {0.0, known.size.height - 1.0}) {
      const lens::Vec2 corner(u, v);
      const lens::Vec2 plain((u - lens.cx) / lens.fx, (v - lens.cy) / lens.fy);
      const double corner_px = (corner - centre).norm();
      if (!(plain.norm() > 0) || !std::isfinite(corner_px)) continue;
      double reached_px = 0;
      for (int step = 1; step < steps && reached_px < corner_px; ++step) {
        const double theta = 0.5 * std::numbers::pi * step / kSteps, t2 = theta * theta;
        const lens::Vec2 n = plain.normalized() * std::tan(theta);
        const double slope =  // of a fisheye's radius; it has no tangential terms
            1 + t2 * (3 * lens.k1 + t2 * (5 * lens.k2 + t2 * (7 * lens.k3 + t2 * 9 * lens.k4)));
        if (!((lens.fisheye ? slope : lens::PixelJacobian(lens, n).determinant()) > 0)) {
          if (!nearest || reached_px < nearest->at_px) nearest = Fold{reached_px, corner_px};
          break;
        }
        const double bent =
            theta * (1 + t2 * (lens.k1 + t2 * (lens.k2 + t2 * (lens.k3 + t2 * lens.k4))));
        reached_px = lens.fisheye ? bent * corner_px / plain.norm()
                                  : (lens::PixelOfNormalised(lens, n) - centre).norm();
      }
    }
  }
  return nearest;
}

std::string CountsText(const std::vector<std::size_t>& counts) {
  return fmt::format("{}", fmt::join(counts, " or "));
}

void CheckTerms(const LensFacts& lens, Recognition& found) {
  if (!lens.terms || lens.model_terms.empty()) return;
  const std::vector<double>& terms = lens.terms->value;
  const std::size_t count = terms.size();
  if (std::ranges::find(lens.model_terms, count) != lens.model_terms.end()) return;
  const std::size_t most = std::ranges::max(lens.model_terms);
  const bool only_zeros =
      count > most && std::all_of(terms.begin() + static_cast<std::ptrdiff_t>(most), terms.end(),
                                  [](double term) { return term == 0; });
  const std::string model =
      lens.model ? fmt::format("{} (line {})", lens.model->value, lens.model->line) : "the model";
  Contradict(found, "distortion",
             fmt::format("{} {}, but {} has {}{}", count, count == 1 ? "term" : "terms", model,
                         CountsText(lens.model_terms),
                         only_zeros ? "; those beyond are 0" : "; one of the two is wrong"),
             lens.terms->line);
}

}  // namespace

void AddLens(const LensFacts& lens, Recognition& found) {
  if (lens.width && lens.height) {
    AddFact(found, "image size",
            fmt::format("{:g} x {:g} px", lens.width->value, lens.height->value), lens.width->line);
  } else {
    found.undecided.emplace_back("the size of the images; the file does not state it");
  }
  if (lens.fx && lens.fy) {
    AddFact(found, "focal length", fmt::format("{:.7g}, {:.7g} px", lens.fx->value, lens.fy->value),
            lens.fx->line);
    if (!(lens.fx->value > 0) || !(lens.fy->value > 0)) {
      Contradict(found, "focal length", "is not positive", lens.fx->line);
    }
  }
  if (lens.cx && lens.cy) {
    AddFact(found, "principal point",
            fmt::format("{:.7g}, {:.7g} px", lens.cx->value, lens.cy->value), lens.cx->line);
    const bool outside = lens.width && lens.height &&
                         (lens.cx->value < 0 || lens.cx->value > lens.width->value ||
                          lens.cy->value < 0 || lens.cy->value > lens.height->value);
    if (outside) {
      Contradict(
          found, "principal point",
          fmt::format("({:.6g}, {:.6g}) lies outside the image of {:g} x {:g} px: numbers of "
                      "another image size, or width and height swapped",
                      lens.cx->value, lens.cy->value, lens.width->value, lens.height->value),
          lens.cx->line);
    }
  }
  if (lens.model) AddFact(found, "distortion model", lens.model->value, lens.model->line);
  if (lens.terms) AddFact(found, "distortion", TermsText(lens.terms->value), lens.terms->line);
  CheckTerms(lens, found);
  if (lens.skew && lens.skew->value != 0) {
    Contradict(found, "skew",
               fmt::format("{:.6g} px; the lens models of OpenCV, ROS and Plumbline have none",
                           lens.skew->value),
               lens.skew->line);
  }
  const auto known = KnownOf(lens);
  if (!known) return;
  if (const auto fold = FoldOf(*known)) {
    Contradict(
        found, "distortion",
        fmt::format("folds back {:.0f} px from the principal point, before the corner of the "
                    "image at {:.0f} px: the numbers do not fit this image",
                    fold->at_px, fold->corner_px),
        lens.terms->line);
  }
}

}  // namespace plumbline::recognition
