#include "app/vision/lens/capture_candidates.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace plumbline::vision {
namespace {

std::vector<int> Range(int first, int count) {
  std::vector<int> values(static_cast<std::size_t>(count));
  std::iota(values.begin(), values.end(), first);
  return values;
}

Rival Global(std::vector<int> extras) {
  Rival rival;
  rival.global = std::move(extras);
  return rival;
}

Rival Local(std::vector<int> extras) {
  Rival rival;
  rival.local = std::move(extras);
  return rival;
}

/// Weights of the views for a change: 0 at the last view.
std::vector<double> CourseOf(const CaptureChange& change, std::span<const BoardView> views) {
  std::vector<double> course;
  const double span_s = views.back().time_s - views.front().time_s;
  for (std::size_t j = 0; j < views.size(); ++j) {
    course.push_back(change.steady ? (views[j].time_s - views.back().time_s) / span_s
                                   : (j < change.first_view_after ? -1 : 0));
  }
  return course;
}

std::string WhenOf(const CaptureChange& change, std::span<const BoardView> views) {
  return change.steady ? "from the first to the last"
                       : fmt::format("between {} and {}", views[change.first_view_after - 1].name,
                                     views[change.first_view_after].name);
}

double SpreadOf(const std::vector<double>& values) {
  const auto [low, high] = std::ranges::minmax_element(values);
  return *high - *low;
}

/// Words for a lens that differs from view to view, or between two groups of views.
std::string VariationWords(const Candidate& candidate, const RivalResult& result) {
  if (!candidate.rival.changing.empty()) {
    return fmt::format(
        "the frames show two states of the camera, as if from two cameras or a lens that goes back "
        "and forth: the focal length differs by {:.2f} %, the principal point by {:.1f} px",
        100 * std::abs(result.extra[kZoom]), result.extra.segment<2>(kShiftX).norm());
  }
  std::vector<double> zooms, shifts_x, shifts_y;
  for (const ExtraVector& local : result.local) {
    zooms.push_back(local[kZoom]);
    shifts_x.push_back(local[kShiftX]);
    shifts_y.push_back(local[kShiftY]);
  }
  const double shift_px = std::hypot(SpreadOf(shifts_x), SpreadOf(shifts_y));
  const std::vector<int>& local = candidate.rival.local;
  if (std::ranges::find(local, kZoom) == local.end())
    return fmt::format("the principal point varies from frame to frame by {:.1f} px", shift_px);
  std::string words =
      fmt::format("the focal length varies from frame to frame by {:.2f} %", 100 * SpreadOf(zooms));
  if (shift_px > 0) words += fmt::format(" and the principal point by {:.1f} px", shift_px);
  return words;
}

double HeightOf(const RivalBoard& board, const RivalResult& result) {
  std::vector<double> heights;
  heights.reserve(board.points().size());
  for (const RivalBoard::Point& point : board.points())
    heights.push_back(result.extra.segment<kHeightTerms>(kHeight).dot(point.height));
  return SpreadOf(heights);
}

std::string StretchWords(const RivalResult& result) {
  if (std::abs(result.extra[kSkew]) > 2 * std::abs(result.extra[kStretch]))
    return fmt::format("the print is skewed by {:.2f} %", 100 * result.extra[kSkew]);
  return fmt::format("the print is stretched by {:.2f} % along its rows",
                     100 * result.extra[kStretch]);
}

/// The fit of an uneven print contains a stretch and a skew: what displaces the points most is
/// named first.
std::string UnevenWords(const RivalBoard& board, const RivalResult& result) {
  double evenly_m = 0, unevenly_m = 0;
  for (const RivalBoard::Point& point : board.points()) {
    const double x_m = result.extra.segment<kPrintTerms>(kPrintX).dot(point.print);
    const double y_m = result.extra.segment<kPrintTerms>(kPrintY).dot(point.print);
    evenly_m = std::max(evenly_m, std::abs(result.extra[kStretch] * point.uv.x() +
                                           result.extra[kSkew] * point.uv.y()));
    unevenly_m = std::max(unevenly_m, std::hypot(x_m, y_m));
  }
  if (evenly_m > unevenly_m)
    return StretchWords(result) + fmt::format(", and uneven by {:.2g} mm", 1e3 * unevenly_m);
  return "the print is uneven: its squares differ in size over the board";
}

/// Largest displacement of a point during the read-out of an image, by pinhole projection [px].
double MotionOf(const RivalBoard& board, const RivalResult& result) {
  const Vec3 centre(board.centre().x(), board.centre().y(), 0);
  double largest = 0;
  for (std::size_t j = 0; j < result.local.size(); ++j) {
    const ExtraVector both = result.local[j] + result.extra;
    for (const RivalBoard::Point& point : board.points()) {
      const Vec3 p_K(point.xy.x(), point.xy.y(), 0);
      const Vec3 p_C = result.X_CK[j] * p_K, arm_C = result.X_CK[j].R * (p_K - centre);
      const Vec3 half = 0.5 * (both.segment<3>(kVelocityX) + both.segment<3>(kSpinX).cross(arm_C));
      const Vec3 first = p_C - half, last = p_C + half;
      largest =
          std::max(largest, result.shared[kFx] *
                                (last.head<2>() / last.z() - first.head<2>() / first.z()).norm());
    }
  }
  return largest;
}

}  // namespace

std::vector<Candidate> ConstantCandidates() {
  using C = CaptureCause;
  Rival fisheye = Global({kK4});
  fisheye.fisheye = true;
  Rival aspect;
  aspect.free_aspect = true;
  Rival uneven_and_stretched = Global(Range(kPrintX, 2 * kPrintTerms));
  uneven_and_stretched.global.insert(uneven_and_stretched.global.end(), {kStretch, kSkew});
  return {{C::kCameraVaries, Local({kZoom})},
          {C::kCameraVaries, Local({kZoom, kShiftX, kShiftY})},
          {C::kPrincipalPoint, Local({kShiftX, kShiftY})},
          {C::kBoardBends, Local({kBendX, kBendY, kBendXY})},
          {C::kRollingShutter, Global({kVelocityX, kVelocityY, kVelocityZ})},
          {C::kRollingShutter, Local({kVelocityX, kVelocityY})},
          {C::kRollingShutter, Local({kSpinX, kSpinY, kSpinZ})},
          {C::kRollingShutter, Local({kVelocityX, kVelocityY, kVelocityZ, kSpinX, kSpinY, kSpinZ})},
          {C::kStretchedPrint, Global({kStretch, kSkew})},
          {C::kUnevenPrint, uneven_and_stretched},
          {C::kBoardNotFlat, Global(Range(kHeight, kHeightTerms))},
          {C::kWindowPane, Global({kPaneX, kPaneY, kPaneZ})},
          {C::kBoardGlass, Global({kBoardGlass})},
          {C::kOtherLensModel, Global({kK4, kK5, kK6})},
          {C::kOtherLensModel, Global({kPrism1, kPrism2, kPrism3, kPrism4})},
          {C::kPixelAspect, aspect, true},
          {C::kOtherLensModel, fisheye, true}};
}

std::vector<ChangeCandidate> ChangeCandidates(const CaptureChangeTest& test,
                                              std::span<const BoardView> views) {
  std::vector<ChangeCandidate> candidates;
  const auto add = [&](CaptureCause cause, const CaptureChange& change, std::vector<int> extras) {
    if (!(change.chi2 > 0)) return;
    ChangeCandidate candidate;
    candidate.cause = cause;
    candidate.rival.changing = std::move(extras);
    candidate.rival.course = CourseOf(change, views);
    candidate.always = true;
    candidate.change = change;
    candidates.push_back(std::move(candidate));
  };
  add(CaptureCause::kFocalLength, test.changes[0], {kZoom});
  add(CaptureCause::kPrincipalPoint, test.changes[1], {kShiftX, kShiftY});
  for (int k : {0, 1}) add(CaptureCause::kFocalLength, test.changes[k], {kZoom, kShiftX, kShiftY});
  add(CaptureCause::kBoardBends, test.changes[2], {kBendX, kBendY, kBendXY});
  return candidates;
}

Rival FreeBoard(const RivalBoard& board, bool bends) {
  const int points = std::min(kMaxFreePoints, static_cast<int>(board.points().size()));
  Rival rival = Global(Range(kFree, 3 * points));
  if (bends) rival.local = {kBendX, kBendY, kBendXY};
  return rival;
}

std::vector<double> TwoStates(const RivalResult& varying) {
  std::vector<double> zooms;
  for (const ExtraVector& local : varying.local) zooms.push_back(local[kZoom]);
  std::vector<double> sorted = zooms;
  std::ranges::sort(sorted);
  const double n = static_cast<double>(sorted.size());
  const double total = std::accumulate(sorted.begin(), sorted.end(), 0.0);
  double below = 0, best = -1, limit = sorted[0];
  for (std::size_t k = 1; k < sorted.size(); ++k) {
    below += sorted[k - 1];
    const double m = static_cast<double>(k);
    const double between = below * below / m + (total - below) * (total - below) / (n - m);
    if (between <= best) continue;
    best = between;
    limit = 0.5 * (sorted[k - 1] + sorted[k]);
  }
  std::vector<double> course;
  course.reserve(zooms.size());
  for (const double zoom : zooms)
    course.push_back((zoom > limit) == (zooms.back() > limit) ? 0 : -1);
  return course;
}

void DescribeFinding(const Candidate& candidate, const RivalResult& result, const RivalBoard& board,
                     CaptureDiagnosis::Finding& finding) {
  const char* fasten =
      "fasten camera, lens and board, switch autofocus, digital zoom and image "
      "stabilisation off, and repeat the capture";
  switch (candidate.cause) {
    case CaptureCause::kNone:
    case CaptureCause::kFocalLength:
    case CaptureCause::kPrincipalPoint:
      finding.remedy = fmt::format("let the zoom come to rest, {}", fasten);
      if (finding.words.empty()) finding.words = VariationWords(candidate, result);
      break;
    case CaptureCause::kCameraVaries:
      finding.words = VariationWords(candidate, result);
      finding.remedy = fmt::format("use the frames of one camera, {}", fasten);
      break;
    case CaptureCause::kBoardBends:
      finding.remedy = "mount the print on a stiff plate and repeat the capture";
      if (finding.words.empty()) finding.words = "the board bends from frame to frame";
      break;
    case CaptureCause::kRollingShutter:
      finding.words = fmt::format(
          "the board moved while the rows of the image were read out (rolling shutter), by up to "
          "{:.1f} px per image",
          MotionOf(board, result));
      finding.remedy = "hold the board still for each frame, or rest it";
      break;
    case CaptureCause::kPixelAspect:
      finding.words = fmt::format("the pixels are not square: fy / fx is {:.4f}",
                                  result.shared[kFy] / result.shared[kFx]);
      finding.remedy =
          "use the sensor's own resolution, without scaling, and rest the board for each frame; or "
          "declare it (--oblong-pixels, or oblong_pixels in [camera])";
      break;
    case CaptureCause::kStretchedPrint:
      finding.words = StretchWords(result);
      finding.remedy = "measure the squares in both directions, and use a board that is true";
      break;
    case CaptureCause::kUnevenPrint:
      finding.words = UnevenWords(board, result);
      finding.remedy = "use a board that is printed true to size, in one piece";
      break;
    case CaptureCause::kBoardNotFlat:
      finding.words = fmt::format("the board is not flat: wavy or S-shaped by {:.2f} mm",
                                  1e3 * HeightOf(board, result));
      finding.remedy = "mount the print on a flat, stiff plate";
      break;
    case CaptureCause::kWindowPane:
      finding.words = fmt::format("the camera looks through a window, glass of about {:.0f} mm",
                                  1e3 * result.extra.segment<3>(kPaneX).norm());
      finding.remedy = "remove the window; no lens model describes it at all distances";
      break;
    case CaptureCause::kBoardGlass:
      finding.words = fmt::format("glass of about {:.1f} mm lies on the board",
                                  1e3 * std::abs(result.extra[kBoardGlass]));
      finding.remedy = "remove the glass, or print on its front";
      break;
    case CaptureCause::kOtherLensModel:
      finding.words = candidate.rival.fisheye
                          ? "the lens is a fisheye, which five distortion coefficients do not "
                            "describe"
                          : "the lens distorts in a way that five coefficients do not describe "
                            "(wide-angle, or tilted elements)";
      finding.remedy = "use a lens with less distortion, or a narrower part of the image";
      break;
  }
}

std::string ChangeWords(const ChangeCandidate& candidate, const RivalResult& result,
                        std::span<const BoardView> views) {
  const std::string when = WhenOf(candidate.change, views);
  switch (candidate.cause) {
    case CaptureCause::kFocalLength: {
      std::string words =
          fmt::format("the focal length changed by {:.2f} % {}", 100 * result.extra[kZoom], when);
      const double shift_px = result.extra.segment<2>(kShiftX).norm();
      if (shift_px > 0) words += fmt::format(", the principal point by {:.1f} px", shift_px);
      return words;
    }
    case CaptureCause::kPrincipalPoint:
      return fmt::format("the principal point moved by {:.1f} px {}",
                         result.extra.segment<2>(kShiftX).norm(), when);
    default:
      return fmt::format("the board bent {}", when);
  }
}

}  // namespace plumbline::vision
