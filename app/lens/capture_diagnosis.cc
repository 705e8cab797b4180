#include "app/lens/capture_diagnosis.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "app/lens/capture_candidates.h"
#include "app/lens/capture_change.h"

namespace plumbline::lens {
namespace {

// Score test: a rival is fitted if its decrease exceeds the mean of chi^2 by this many standard
// deviations.
constexpr double kMaxScore = 6;
constexpr double kUsualAspect = 1.5e-3;  // of fy / fx from 1
constexpr double kMinEvidence = 10;      // "very strong": A. Raftery, Sociol. Methodol. 25 (1995)
constexpr double kClearEvidence = 10;    // advantage of the best cause over another one
constexpr double kMaxUnexplained = 9;    // variance of the best fit, in units of the noise
constexpr double kMinExplained = 0.9;    // .. unless it explains this share of the sum of squares
constexpr int kGridColumns = 9, kGridRows = 7;

/// Largest difference over the image between the pixels of equal directions by the plain lens and
/// by the rival's lens, after the best rotation [px].
double LensDifference(const SharedVector& plain, const Rival& rival, const RivalResult& result,
                      const ExtraVector& of_view, image::ImageSize size) {
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
  ExtraVector extra = result.extra + of_view;
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

/// One fitted explanation.
struct Attempt {
  CaptureDiagnosis::Finding finding;
  RivalResult result;
};

double Criterion(const RivalResult& result, double dispersion) {
  const double observations = std::max(1, result.observations);
  const double n = observations / dispersion;
  return n * std::log(std::max(1e-12, result.square_sum_px2) / observations) +
         result.prior_chi2 / dispersion + result.parameters * std::log(n);
}

/// Whether a score test, or the shape of the pixels, raises a doubt about the plain model.
bool Doubtful(const RivalProblem& problem, const RivalResult& plain,
              const std::vector<Candidate>& candidates) {
  if (std::abs(plain.shared[kFy] / plain.shared[kFx] - 1) > kUsualAspect) return true;
  std::vector<Rival> rivals;
  for (const Candidate& candidate : candidates) {
    if (!candidate.always) rivals.push_back(candidate.rival);
  }
  const std::vector<double> scores = problem.ScoreTests(rivals, plain);
  for (std::size_t k = 0; k < rivals.size(); ++k) {
    const auto freedom =
        static_cast<double>(rivals[k].global.size() + rivals[k].local.size() * plain.X_CK.size());
    if (scores[k] > freedom + kMaxScore * std::sqrt(2 * freedom)) return true;
  }
  return false;
}

/// Fits of all explanations of one capture.
class Attempts {
 public:
  Attempts(const RivalProblem& problem, const RivalResult& plain, const LensFit& fit,
           image::ImageSize size, std::span<const BoardView> views)
      : problem_(problem), plain_(plain), fit_(fit), size_(size), views_(views) {}

  /// @param words     if not empty, written from the result
  /// @param extra_chi2  for parameters that are chosen otherwise
  void Add(const Candidate& candidate, double extra_chi2 = 0,
           const std::function<std::string(const RivalResult&)>& words = {}) {
    Attempt attempt;
    attempt.result = problem_.Fit(candidate.rival, plain_);
    if (!attempt.result.converged) return;
    attempt.result.prior_chi2 += extra_chi2;
    attempt.finding.cause = candidate.cause;
    if (words) attempt.finding.words = words(attempt.result);
    DescribeFinding(candidate, attempt.result, problem_.board(), attempt.finding);
    attempt.finding.error_px = LargestDifference(candidate.rival, attempt.result);
    all_.push_back(std::move(attempt));
  }
  /// Splits the views by each varying zoom that has been fitted; each assignment costs ln 2.
  void AddTwoStates() {
    for (std::size_t k = 0, count = all_.size(); k < count; ++k) {
      if (all_[k].finding.cause != CaptureCause::kCameraVaries) continue;
      Candidate states{CaptureCause::kCameraVaries, {}, true};
      states.rival.changing = {kZoom, kShiftX, kShiftY};
      states.rival.course = TwoStates(all_[k].result);
      Add(states, 2 * std::log(2.0) * static_cast<double>(views_.size()));
    }
  }
  /// Changes at their most likely time, which counts as a parameter.
  void AddChanges() {
    const LensFit linearized = problem_.Linearized(plain_);
    if (linearized.view_information.empty()) return;
    const CaptureChangeTest test = TestForCaptureChanges(linearized, views_, 1);
    for (const ChangeCandidate& candidate : ChangeCandidates(test, views_)) {
      Add(candidate, std::log(static_cast<double>(plain_.observations)),
          [&](const RivalResult& result) { return ChangeWords(candidate, result, views_); });
    }
  }
  /// Sorts by evidence, the best first.
  void Rank(double noise_px) {
    double least_px2 = plain_.square_sum_px2;
    for (const Attempt& attempt : all_)
      least_px2 = std::min(least_px2, attempt.result.square_sum_px2);
    const double dispersion =
        std::max(1.0, least_px2 / plain_.observations / (noise_px * noise_px));
    const double base = Criterion(plain_, dispersion);
    for (Attempt& attempt : all_)
      attempt.finding.evidence = base - Criterion(attempt.result, dispersion);
    std::sort(all_.begin(), all_.end(), [](const Attempt& a, const Attempt& b) {
      return a.finding.evidence > b.finding.evidence;
    });
  }
  const std::vector<Attempt>& all() const { return all_; }

 private:
  /// The largest difference over all views: a camera that varies has another lens at each.
  double LargestDifference(const Rival& rival, const RivalResult& result) const {
    const auto difference = [&](const ExtraVector& of_view) {
      return LensDifference(fit_.shared, rival, result, of_view, size_);
    };
    double largest = difference(ExtraVector::Zero());
    if (rival.local.empty()) return largest;
    for (const ExtraVector& of_view : result.local) {
      largest = std::max(largest, difference(of_view));
    }
    return largest;
  }

  const RivalProblem& problem_;
  const RivalResult& plain_;
  const LensFit& fit_;
  image::ImageSize size_;
  std::span<const BoardView> views_;
  std::vector<Attempt> all_;
};

}  // namespace

CaptureDiagnosis DiagnoseCapture(const Board& board, std::span<const BoardView> views,
                                 image::ImageSize size, const LensFit& fit,
                                 const ViewConsistency& consistency, bool force) {
  CaptureDiagnosis diagnosis;
  const RivalProblem problem(board, views, size, fit, consistency.used, consistency.noise_px);
  const RivalResult plain = problem.Fit({});
  if (!plain.converged) return diagnosis;
  const std::vector<Candidate> constant = ConstantCandidates();
  if (!force && !Doubtful(problem, plain, constant)) return diagnosis;
  // All explanations are fitted, so that each is compared with its rivals.
  Attempts attempts(problem, plain, fit, size, views);
  for (const Candidate& candidate : constant) attempts.Add(candidate);
  attempts.AddTwoStates();
  attempts.AddChanges();
  attempts.Rank(consistency.noise_px);
  if (attempts.all().empty()) return diagnosis;
  const Attempt& first = attempts.all().front();
  if (first.finding.evidence < kMinEvidence) return diagnosis;
  for (const Attempt& attempt : attempts.all()) {
    if (attempt.finding.evidence < std::max(kMinEvidence, first.finding.evidence - kClearEvidence))
      break;
    const bool same =
        std::any_of(diagnosis.findings.begin(), diagnosis.findings.end(),
                    [&](const auto& finding) { return finding.cause == attempt.finding.cause; });
    if (!same) diagnosis.findings.push_back(attempt.finding);
  }
  const double noise2 = consistency.noise_px * consistency.noise_px;
  diagnosis.incomplete =
      first.result.square_sum_px2 > kMaxUnexplained * noise2 * plain.observations &&
      first.result.square_sum_px2 > (1 - kMinExplained) * plain.square_sum_px2;
  return diagnosis;
}

}  // namespace plumbline::lens
