#include "app/lens/capture_diagnosis.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "app/lens/capture_change.h"
#include "firmware-like/statistics/median.h"

namespace plumbline::lens {
namespace {

// Score test: a rival is fitted if its decrease exceeds the mean of chi^2 by this many standard
// deviations.
constexpr double kMaxScore = 6;
constexpr double kMinEvidence = 10;    // "very strong": A. Raftery, Sociol. Methodol. 25 (1995)
constexpr double kClearEvidence = 10;  // advantage of the best cause over another one
constexpr double kMaxUnexplained = 9;  // variance of the best fit, in units of the noise
constexpr double kMinExplained = 0.9;  // .. unless it explains this share of the sum of squares
constexpr int kGridColumns = 9, kGridRows = 7;

struct Candidate {
  CaptureCause cause = CaptureCause::kNone;
  Rival rival;
  bool always = false;  ///< not covered by the score tests
};

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

/// The changes of lens and board at their most likely time.
struct ChangeCandidate : Candidate {
  CaptureChange change;
};
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

/// Largest difference over the image between the pixels of equal directions by the plain lens and
/// by the rival's lens, after the best rotation [px].
double LensDifference(const SharedVector& plain, const Rival& rival, const RivalResult& result,
                      image::ImageSize size) {
  const Lens lens = LensFromShared(plain);
  std::vector<Vec3> directions;
  std::vector<Vec2> pixels;
  for (int row = 0; row < kGridRows; ++row) {
    for (int column = 0; column < kGridColumns; ++column) {
      const Vec2 pixel((size.width - 1.0) * column / (kGridColumns - 1),
                       (size.height - 1.0) * row / (kGridRows - 1));
      const auto n = NormalisedOfPixel(lens, pixel);
      if (!n) return INFINITY;
      directions.push_back(Vec3(n->x(), n->y(), 1).normalized());
      pixels.push_back(pixel);
    }
  }
  ExtraVector extra = result.extra;
  for (const int k : rival.changing) extra[k] = 0;  // at the last view
  Mat3 R = Mat3::Identity();
  double largest = 0;
  for (int pass = 0; pass < 6; ++pass) {
    constexpr double kStep = 1e-6;
    Mat3 square = Mat3::Zero();
    Vec3 mixed = Vec3::Zero();
    largest = 0;
    for (std::size_t k = 0; k < pixels.size(); ++k) {
      const Vec3 d = R * directions[k];
      if (!(d.z() > 0)) return INFINITY;
      const Vec2 at = RivalPixelOf(rival.fisheye, result.shared, extra, d);
      const Vec2 error = at - pixels[k];
      largest = std::max(largest, error.norm());
      Eigen::Matrix<double, 2, 3> J;
      for (int axis = 0; axis < 3; ++axis) {
        J.col(axis) = (RivalPixelOf(rival.fisheye, result.shared, extra,
                                    d + kStep * Vec3::Unit(axis).cross(d)) -
                       at) /
                      kStep;
      }
      square += J.transpose() * J;
      mixed += J.transpose() * error;
    }
    const Vec3 w = -square.ldlt().solve(mixed);
    if (!w.allFinite()) return INFINITY;
    if (w.norm() < 1e-10) break;
    R = Eigen::AngleAxisd(w.norm(), w.normalized()).toRotationMatrix() * R;
  }
  return largest;
}

/// Weights of the views that separate two states of the camera: 0 for those in the state of the
/// last view, -1 for the others. The zooms are split where that reduces their variance most.
std::vector<double> TwoStates(const RivalResult& varying) {
  std::vector<double> zooms;
  for (const ExtraVector& local : varying.local) zooms.push_back(local[kZoom]);
  std::vector<double> sorted = zooms;
  std::sort(sorted.begin(), sorted.end());
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
  for (const double zoom : zooms)
    course.push_back((zoom > limit) == (zooms.back() > limit) ? 0 : -1);
  return course;
}

double SpreadOf(const std::vector<double>& values) {
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  return *high - *low;
}

std::string LocalWords(const Candidate& candidate, const RivalResult& result) {
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
  std::string words =
      fmt::format("the focal length varies from frame to frame by {:.2f} %", 100 * SpreadOf(zooms));
  if (shift_px > 0) words += fmt::format(" and the principal point by {:.1f} px", shift_px);
  return words;
}

double HeightOf(const RivalBoard& board, const RivalResult& result) {
  std::vector<double> heights;
  for (const RivalBoard::Point& point : board.points())
    heights.push_back(result.extra.segment<kHeightTerms>(kHeight).dot(point.height));
  return SpreadOf(heights);
}

double MotionOf(const RivalResult& result) {
  double largest = 0;
  for (std::size_t j = 0; j < result.local.size(); ++j) {
    const ExtraVector both = result.local[j] + result.extra;
    const double f = result.shared[kFx], z = result.X_CK[j].p.z();
    largest = std::max({largest, f * both.segment<2>(kVelocityX).norm() / z,
                        f * both.segment<2>(kSpinX).norm() * 0.1});
  }
  return largest;
}

void Describe(const Candidate& candidate, const RivalResult& result, const RivalBoard& board,
              CaptureDiagnosis::Finding& finding) {
  const char* fasten =
      "fasten camera, lens and board, switch autofocus, digital zoom and image "
      "stabilisation off, and repeat the capture";
  switch (candidate.cause) {
    case CaptureCause::kNone:
    case CaptureCause::kFocalLength:
    case CaptureCause::kPrincipalPoint:
      finding.remedy = fmt::format("let the zoom come to rest, {}", fasten);
      break;
    case CaptureCause::kCameraVaries:
      finding.words = LocalWords(candidate, result);
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
          MotionOf(result));
      finding.remedy = "hold the board still for each frame, or rest it";
      break;
    case CaptureCause::kPixelAspect:
      finding.words = fmt::format("the pixels are not square: fy / fx is {:.4f}",
                                  result.shared[kFy] / result.shared[kFx]);
      finding.remedy = "use the sensor's own resolution, without scaling";
      break;
    case CaptureCause::kStretchedPrint:
      finding.words = fmt::format("the print is stretched by {:.2f} % along its rows",
                                  100 * result.extra[kStretch]);
      if (std::abs(result.extra[kSkew]) > 2 * std::abs(result.extra[kStretch]))
        finding.words = fmt::format("the print is skewed by {:.2f} %", 100 * result.extra[kSkew]);
      finding.remedy = "measure the squares in both directions, and use a board that is true";
      break;
    case CaptureCause::kUnevenPrint:
      finding.words = "the print is uneven: its squares differ in size over the board";
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

/// One fitted explanation.
struct Attempt {
  CaptureDiagnosis::Finding finding;
  RivalResult result;
};

double Criterion(const RivalResult& result, double dispersion) {
  const double n = result.observations / dispersion;
  return n * std::log(result.square_sum_px2 / result.observations) +
         result.prior_chi2 / dispersion + result.parameters * std::log(n);
}

}  // namespace

CaptureDiagnosis DiagnoseCapture(const Board& board, std::span<const BoardView> views,
                                 image::ImageSize size, const LensFit& fit,
                                 const ViewConsistency& consistency, bool force) {
  CaptureDiagnosis diagnosis;
  const RivalProblem problem(board, views, size, fit, consistency.used, consistency.noise_px);
  const RivalResult plain = problem.Fit({});
  if (!plain.converged) return diagnosis;
  std::vector<Candidate> constant = ConstantCandidates();
  std::vector<Rival> rivals;
  for (const Candidate& candidate : constant) rivals.push_back(candidate.rival);
  const std::vector<double> scores = problem.ScoreTests(rivals, plain);
  std::vector<std::size_t> significant;
  for (std::size_t k = 0; k < constant.size(); ++k) {
    const double freedom =
        static_cast<double>(rivals[k].global.size() + rivals[k].local.size() * views.size());
    const bool high = freedom > 0 && scores[k] > freedom + kMaxScore * std::sqrt(2 * freedom);
    if (high && !constant[k].always) significant.push_back(k);
    if (constant[k].cause == CaptureCause::kPixelAspect &&
        std::abs(plain.shared[kFy] / plain.shared[kFx] - 1) > 1.5e-3)
      significant.push_back(k);
  }
  if (significant.empty() && !force) return diagnosis;
  // Something is wrong: fit all explanations, so that each is compared with its rivals.
  std::vector<Attempt> attempts;
  for (const Candidate& candidate : constant) {
    Attempt attempt;
    attempt.result = problem.Fit(candidate.rival, plain);
    if (!attempt.result.converged) continue;
    attempt.finding.cause = candidate.cause;
    Describe(candidate, attempt.result, problem.board(), attempt.finding);
    attempt.finding.error_px = LensDifference(fit.shared, candidate.rival, attempt.result, size);
    attempts.push_back(std::move(attempt));
  }
  for (std::size_t k = 0, count = attempts.size(); k < count; ++k) {
    if (attempts[k].finding.cause != CaptureCause::kCameraVaries) continue;
    Candidate states{CaptureCause::kCameraVaries, {}, true};
    states.rival.changing = {kZoom, kShiftX, kShiftY};
    states.rival.course = TwoStates(attempts[k].result);
    Attempt attempt;
    attempt.result = problem.Fit(states.rival, plain);
    if (!attempt.result.converged) continue;
    attempt.result.prior_chi2 += 2 * std::log(2.0) * static_cast<double>(views.size());
    attempt.finding.cause = states.cause;
    Describe(states, attempt.result, problem.board(), attempt.finding);
    attempt.finding.error_px = LensDifference(fit.shared, states.rival, attempt.result, size);
    attempts.push_back(std::move(attempt));
  }
  const CaptureChangeTest test = TestForCaptureChanges(problem.Linearized(plain), views, 1);
  for (const ChangeCandidate& candidate : ChangeCandidates(test, views)) {
    Attempt attempt;
    attempt.result = problem.Fit(candidate.rival, plain);
    if (!attempt.result.converged) continue;
    attempt.result.parameters += 1;  // the time of the change
    attempt.finding.cause = candidate.cause;
    attempt.finding.words = ChangeWords(candidate, attempt.result, views);
    Describe(candidate, attempt.result, problem.board(), attempt.finding);
    attempt.finding.error_px = LensDifference(fit.shared, candidate.rival, attempt.result, size);
    attempts.push_back(std::move(attempt));
  }
  if (attempts.empty()) return diagnosis;
  double least_px2 = plain.square_sum_px2;
  for (const Attempt& attempt : attempts)
    least_px2 = std::min(least_px2, attempt.result.square_sum_px2);
  const double noise2 = consistency.noise_px * consistency.noise_px;
  const double dispersion = std::max(1.0, least_px2 / plain.observations / noise2);
  const double base = Criterion(plain, dispersion);
  for (Attempt& attempt : attempts)
    attempt.finding.evidence = base - Criterion(attempt.result, dispersion);
  std::sort(attempts.begin(), attempts.end(), [](const Attempt& a, const Attempt& b) {
    return a.finding.evidence > b.finding.evidence;
  });
  const double best = attempts[0].finding.evidence;
  if (best < kMinEvidence) return diagnosis;
  for (const Attempt& attempt : attempts) {
    if (attempt.finding.evidence < std::max(kMinEvidence, best - kClearEvidence)) break;
    const bool same =
        std::any_of(diagnosis.findings.begin(), diagnosis.findings.end(),
                    [&](const auto& finding) { return finding.cause == attempt.finding.cause; });
    if (!same) diagnosis.findings.push_back(attempt.finding);
  }
  diagnosis.incomplete =
      attempts[0].result.square_sum_px2 > kMaxUnexplained * noise2 * plain.observations &&
      attempts[0].result.square_sum_px2 > (1 - kMinExplained) * plain.square_sum_px2;
  return diagnosis;
}

}  // namespace plumbline::lens
