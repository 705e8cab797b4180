#include "app/vision/lens/capture_diagnosis.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <utility>

#include "app/vision/lens/capture_candidates.h"
#include "app/vision/lens/capture_change.h"
#include "app/vision/lens/rival_difference.h"
#include "app/vision/lens/unproved_effects.h"
#include "firmware-like/statistics/statistics.h"

namespace plumbline::vision {
bool LeavesOneLens(CaptureCause cause) {
  switch (cause) {
    case CaptureCause::kPixelAspect:
    case CaptureCause::kStretchedPrint:
    case CaptureCause::kUnevenPrint:
    case CaptureCause::kBoardNotFlat:
    case CaptureCause::kBoardGlass:
    case CaptureCause::kOtherLensModel:
      return true;
    case CaptureCause::kNone:
    case CaptureCause::kFocalLength:
    case CaptureCause::kPrincipalPoint:
    case CaptureCause::kCameraVaries:
    case CaptureCause::kBoardBends:
    case CaptureCause::kRollingShutter:
    case CaptureCause::kWindowPane:
      break;
  }
  return false;
}

bool DeclaredAbsent(const target::DeclaredFacts& declared, CaptureCause cause) {
  if (cause == CaptureCause::kWindowPane) return declared.no_window;
  return declared.fixed_focus &&
         (cause == CaptureCause::kFocalLength || cause == CaptureCause::kCameraVaries);
}

void IncludeErrors(CaptureCause cause, const RadiusErrors& errors_px, RadiusErrors& largest) {
  for (std::size_t k = 0; k < largest.size(); ++k)
    largest[k] = std::max(largest[k], errors_px[LeavesOneLens(cause) ? k : 0]);
}

namespace {

// Score test: a rival is fitted if its decrease exceeds the mean of chi^2 by this many standard
// deviations.
constexpr double kMaxScore = 6;
constexpr double kMostPlausible = 4;     // of a parameter, in standard deviations of its prior
constexpr double kUsualAspect = 1.5e-3;  // of fy / fx from 1
constexpr double kMinEvidence = 10;      // "very strong": A. Raftery, Sociol. Methodol. 25 (1995)
constexpr double kClearEvidence = 10;    // advantage of the best cause over another one
constexpr double kMaxUnexplained = 9;    // variance of the best fit, in units of the noise
constexpr double kMinExplained = 0.9;    // .. unless it explains this share of the sum of squares
constexpr double kMinFreeNoise_px = 0.01;
constexpr double kCredibleShare = 1.0 / 3;  // of the evidence of a board
constexpr double kPaneStart_m = 0.005;      // without thickness, its tilt has no effect
constexpr double kNoisyShare = 1.5;         // variance of the residuals, in units of the noise
constexpr double kMinNamed = 0.75;  // of the variance beyond the noise that a named cause explains

/// One fitted explanation.
struct Attempt {
  CaptureDiagnosis::Finding finding;
  Rival rival;
  RivalResult result;
};

double Criterion(const RivalResult& result, double dispersion) {
  const double observations = std::max(1, result.observations);
  const double n = observations / dispersion;
  return n * std::log(std::max(1e-12, result.square_sum_px2) / observations) +
         result.prior_chi2 / dispersion + result.parameters * std::log(n);
}

/// Whether a score test, or the shape of the pixels, raises a doubt about the plain model.
bool Doubtful(const RivalResult& plain, const ScoredCandidates& scored,
              const target::DeclaredFacts& declared) {
  if (!declared.oblong_pixels && std::abs(plain.shared[kFy] / plain.shared[kFx] - 1) > kUsualAspect)
    return true;
  for (std::size_t k = 0; k < scored.tests.size(); ++k) {
    const Rival& rival = scored.tests[k].rival;
    const auto freedom =
        static_cast<double>(rival.global.size() + rival.local.size() * plain.X_CK.size());
    if (scored.tests[k].decrease > freedom + kMaxScore * std::sqrt(2 * freedom)) return true;
  }
  return false;
}

/// Whether one explanation contains the parameters of another one.
bool Contains(const Rival& whole, const Rival& part) {
  const auto all_in = [](const std::vector<int>& few, const std::vector<int>& many) {
    return std::ranges::all_of(few,
                               [&](int k) { return std::ranges::find(many, k) != many.end(); });
  };
  return whole.fisheye == part.fisheye && whole.free_aspect == part.free_aspect &&
         whole.course == part.course && all_in(part.global, whole.global) &&
         all_in(part.local, whole.local) && all_in(part.changing, whole.changing);
}

/// Fits of all explanations of one capture.
class Attempts {
 public:
  Attempts(const RivalProblem& problem, const RivalResult& plain, std::span<const BoardView> views)
      : problem_(problem), plain_(plain), views_(views) {}

  /// @param words     if not empty, written from the result
  /// @param extra_chi2  for parameters that are chosen otherwise
  void Add(const Candidate& candidate, double extra_chi2 = 0,
           const std::function<std::string(const RivalResult&)>& words = {}) {
    Attempt attempt;
    RivalResult start = plain_;
    if (candidate.cause == CaptureCause::kWindowPane) start.extra[kPaneZ] = kPaneStart_m;
    attempt.rival = candidate.rival;
    attempt.result = problem_.Fit(candidate.rival, start);
    if (!attempt.result.converged || !Possible(attempt)) return;
    attempt.result.prior_chi2 += extra_chi2;
    attempt.finding.cause = candidate.cause;
    if (words) attempt.finding.words = words(attempt.result);
    DescribeFinding(candidate, attempt.result, problem_.board(), attempt.finding);
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
    const LensFit linearized = problem_.Linearized({}, plain_);
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
    std::ranges::sort(all_, [](const Attempt& a, const Attempt& b) {
      return a.finding.evidence > b.finding.evidence;
    });
  }
  const std::vector<Attempt>& all() const { return all_; }

 private:
  /// Whether no parameter is far beyond what is plausible.
  bool Possible(const Attempt& attempt) const {
    const ExtraVector most = kMostPlausible * problem_.DeviationsOf(attempt.rival);
    const auto possible = [&](const ExtraVector& extra) {
      return (extra.array().abs() <= most.array()).all();
    };
    return possible(attempt.result.extra) && std::ranges::all_of(attempt.result.local, possible);
  }

  const RivalProblem& problem_;
  const RivalResult& plain_;
  std::span<const BoardView> views_;
  std::vector<Attempt> all_;
};

/// Whether a cause is the board, so that its points must be free.
bool IsBoard(CaptureCause cause) {
  return cause == CaptureCause::kUnevenPrint || cause == CaptureCause::kBoardNotFlat ||
         cause == CaptureCause::kBoardBends;
}

/// One capture, for fits with another noise.
struct CaptureViews {
  const target::Board& board;
  std::span<const BoardView> views;
  image::ImageSize size;
  const LensFit& fit;
  const ViewConsistency& consistency;
  const target::DeclaredFacts& declared;

  RivalProblem Problem(double noise_px) const {
    return {board, views, size, fit, consistency.used, noise_px, declared.oblong_pixels};
  }
};

/// The lens by a fitted explanation; nothing if a point is not in front of the camera.
std::optional<CaptureDiagnosis::Adopted> AdoptedBy(const CaptureViews& capture,
                                                   const RivalProblem& problem, const Rival& rival,
                                                   const RivalResult& result, double noise_px) {
  std::vector<Candidate> candidates = ConstantCandidates();
  if (!rival.global.empty() && rival.global.back() >= kFree) {  // the board is free already
    std::erase_if(candidates, [](const Candidate& candidate) { return IsBoard(candidate.cause); });
  }
  const RivalPrecision precision = problem.PrecisionOf(rival, result);
  LensFit linearized = problem.Linearized(rival, result);
  if (linearized.view_information.empty()) return std::nullopt;
  linearized.sigma_px = precision.sigma_px;
  return CaptureDiagnosis::Adopted{
      LensOfRival(rival.fisheye, result.shared, result.extra),
      precision,
      result.shared.segment<3>(kBowX),
      std::sqrt(2 * result.square_sum_px2 / std::max(1, result.observations)),
      std::move(linearized),
      {},
      UnprovedEffects(ScoreTestsOf(problem, rival, result, candidates), rival, result, noise_px,
                      capture.size, capture.declared)};
}

/// The lens with a free board. The errors of the print count as noise until its points are free, so
/// that the fit is repeated with the noise of its residuals.
std::optional<CaptureDiagnosis::Adopted> AdoptedWithFreeBoard(const CaptureViews& capture,
                                                              const RivalProblem& problem,
                                                              const RivalResult& plain,
                                                              bool bends) {
  const Rival board = FreeBoard(problem.board(), bends);
  const RivalResult first = problem.Fit(board, plain);
  if (!first.converged) return std::nullopt;
  const double sigma_px = problem.PrecisionOf(board, first).sigma_px;
  const double noise_px = std::clamp(sigma_px, kMinFreeNoise_px,
                                     std::max(kMinFreeNoise_px, capture.consistency.noise_px));
  const RivalProblem finer = capture.Problem(noise_px);
  const RivalResult result = finer.Fit(board, first);
  if (!result.converged) return std::nullopt;
  return AdoptedBy(capture, finer, board, result, noise_px);
}

/// @param others  explanations that the residuals do not exclude either
std::vector<CaptureDiagnosis::Adopted> AdoptedFrom(const CaptureViews& capture,
                                                   const RivalProblem& problem,
                                                   const RivalResult& plain, const Attempt& first,
                                                   const std::vector<const Attempt*>& others) {
  std::vector<CaptureDiagnosis::Adopted> adopted;
  if (IsBoard(first.finding.cause)) {
    for (const bool bends : {false, true}) {
      if (auto one = AdoptedWithFreeBoard(capture, problem, plain, bends))
        adopted.push_back(std::move(*one));
    }
  } else if (LeavesOneLens(first.finding.cause)) {
    if (auto one =
            AdoptedBy(capture, problem, first.rival, first.result, capture.consistency.noise_px))
      adopted.push_back(std::move(*one));
  }
  for (CaptureDiagnosis::Adopted& one : adopted) {
    for (const Attempt* other : others) {
      if (IsBoard(first.finding.cause) && IsBoard(other->finding.cause)) continue;  // included
      IncludeErrors(other->finding.cause,
                    LensDifferences(one.lens, other->rival, other->result, capture.size),
                    one.error_px);
    }
  }
  return adopted;
}

/// Adds the explanations that the residuals do not exclude. One of the same cause as a better one,
/// or that contains a better one, is not listed, since it names no other cause; but its lens
/// remains as credible.
/// @return  those beside the first
std::vector<const Attempt*> AddFindings(const Attempts& attempts, const lens::Lens& plain,
                                        image::ImageSize size, CaptureDiagnosis& diagnosis) {
  const Attempt& first = attempts.all().front();
  std::vector<const Attempt*> listed, others;
  for (const Attempt& attempt : attempts.all()) {
    const CaptureDiagnosis::Finding& found = attempt.finding;
    if (found.evidence < std::max(kMinEvidence, first.finding.evidence - kClearEvidence)) break;
    const bool same = std::ranges::any_of(
        listed, [&](const Attempt* better) { return better->finding.cause == found.cause; });
    const RadiusErrors error_px = LensDifferences(plain, attempt.rival, attempt.result, size);
    if (&attempt != &first) others.push_back(&attempt);
    if (same || std::ranges::any_of(listed, [&](const Attempt* better) {
          return Contains(attempt.rival, better->rival);
        })) {
      IncludeErrors(found.cause, error_px, diagnosis.contained_px);
      continue;
    }
    listed.push_back(&attempt);
    diagnosis.findings.push_back(found);
    diagnosis.findings.back().error_px = error_px;
  }
  return others;
}

/// A free board absorbs part of what a window or a shutter does: those that explain a good part of
/// the same evidence stay credible, unless they are declared to be absent.
void AddCredibleBesideBoard(const Attempts& attempts, const target::DeclaredFacts& declared,
                            std::vector<const Attempt*>& others) {
  const double least =
      std::max(kMinEvidence, kCredibleShare * attempts.all().front().finding.evidence);
  for (const Attempt& attempt : attempts.all()) {
    const CaptureCause cause = attempt.finding.cause;
    if (IsBoard(cause) || DeclaredAbsent(declared, cause) || !(attempt.finding.evidence > least))
      continue;
    if (std::ranges::find(others, &attempt) == others.end()) others.push_back(&attempt);
  }
}

/// True if two causes have one remedy: a lens that moved, whatever changed in it, or a print that
/// is not true to size.
bool HaveOneRemedy(CaptureCause a, CaptureCause b) {
  const auto family = [](CaptureCause cause) {
    if (cause == CaptureCause::kPrincipalPoint || cause == CaptureCause::kCameraVaries)
      return CaptureCause::kFocalLength;
    return cause == CaptureCause::kStretchedPrint ? CaptureCause::kUnevenPrint : cause;
  };
  return family(a) == family(b);
}

/// A step in the print is not a smooth function of the place, so that the fitted terms leave a part
/// of it: whether the free points of the board leave nothing. Otherwise nothing is adopted.
/// @param most_px2  largest variance of a coordinate that counts as nothing
void CompleteWithFreeBoard(double most_px2, CaptureDiagnosis& diagnosis) {
  if (diagnosis.adopted.empty() || 0.5 * std::pow(diagnosis.adopted.front().rms_px, 2) > most_px2) {
    diagnosis.adopted.clear();
    return;
  }
  diagnosis.incomplete = diagnosis.explains_little = false;
}

}  // namespace

bool CaptureDiagnosis::clear() const {
  return !incomplete && !findings.empty() &&
         std::ranges::all_of(findings, [this](const Finding& finding) {
           return HaveOneRemedy(finding.cause, findings.front().cause);
         });
}

CaptureDiagnosis DiagnoseCapture(const target::Board& board, std::span<const BoardView> views,
                                 image::ImageSize size, const LensFit& fit,
                                 const ViewConsistency& consistency,
                                 const target::DeclaredFacts& declared, bool force) {
  CaptureDiagnosis diagnosis;
  const CaptureViews capture{board, views, size, fit, consistency, declared};
  const RivalProblem problem = capture.Problem(consistency.noise_px);
  const RivalResult plain = problem.Fit({});
  if (!plain.converged) return diagnosis;
  const std::vector<Candidate> constant = ConstantCandidates();
  const ScoredCandidates scored = ScoreTestsOf(problem, {}, plain, constant);
  diagnosis.unproved = UnprovedEffects(scored, {}, plain, consistency.noise_px, size, declared);
  if (!force && !Doubtful(plain, scored, declared)) return diagnosis;
  // All explanations are fitted, so that each is compared with its rivals.
  Attempts attempts(problem, plain, views);
  for (const Candidate& candidate : constant) attempts.Add(candidate);
  attempts.AddTwoStates();
  attempts.AddChanges();
  attempts.Rank(consistency.noise_px);
  if (attempts.all().empty()) return diagnosis;
  const Attempt& first = attempts.all().front();
  if (first.finding.evidence < kMinEvidence) return diagnosis;
  diagnosis.unproved.clear();  // the residuals of the plain lens show what was found
  const double noise2 = consistency.noise_px * consistency.noise_px;
  diagnosis.incomplete =
      first.result.square_sum_px2 > kMaxUnexplained * noise2 * plain.observations &&
      first.result.square_sum_px2 > (1 - kMinExplained) * plain.square_sum_px2;
  const double noise_px2 = noise2 * plain.observations;
  diagnosis.explains_little = first.result.square_sum_px2 > kNoisyShare * noise_px2 &&
                              first.result.square_sum_px2 - noise_px2 >
                                  (1 - kMinNamed) * (plain.square_sum_px2 - noise_px2);
  std::vector<const Attempt*> others =
      AddFindings(attempts, LensFromShared(fit.shared), size, diagnosis);
  if (IsBoard(first.finding.cause)) AddCredibleBesideBoard(attempts, declared, others);
  if (!diagnosis.incomplete || IsBoard(first.finding.cause))
    diagnosis.adopted = AdoptedFrom(capture, problem, plain, first, others);
  if (diagnosis.incomplete) CompleteWithFreeBoard(kMaxUnexplained * noise2, diagnosis);
  return diagnosis;
}

}  // namespace plumbline::vision
