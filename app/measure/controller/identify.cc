#include "app/measure/controller/identify.h"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>

#include "app/measure/urdf/chain_difference.h"
#include "firmware-like/geometry/rotation.h"
#include "firmware-like/geometry/units.h"
#include "firmware-like/statistics/statistics.h"

namespace plumbline::measure {
namespace {

using Kind = RelationKind;
using Verdict = Identification::Verdict;

const double kDecisive = std::log(1000.0);  // of two probabilities
const double kNominalPrior = std::log(1e4);
const double kPairPrior = -std::log(100.0);
constexpr double kMoved = 5 * kRadPerDeg;   // [rad], and metres times 1
constexpr double kScreeningTail = 1e-8;     // probability at which screening rejects
constexpr std::size_t kMostPredicted = 40;  // hypotheses with predictions
constexpr int kTried = 60;                  // postures of a comparison
constexpr std::size_t kNext = 3;
constexpr double kSureDeviations = 3.09;  // of a normal distribution: 1 in 1000, one-sided
constexpr double kLargestCorrelation = 1 - 1e-9;
constexpr double kFloorOfCorrection_m = 1e-6;  // below it, a cell corrects nothing

bool OfReading(Kind kind) {
  return kind == Kind::kLengthUnit || kind == Kind::kAngleUnit || kind == Kind::kAngleConvention ||
         kind == Kind::kInverseRotation || kind == Kind::kInversePose ||
         kind == Kind::kQuaternionOrder || kind == Kind::kMirroredAxis;
}

Compensation Compensates(Kind kind) {
  if (kind == Kind::kCellDeflection || kind == Kind::kJointCompliance)
    return Compensation::kDeflection;
  const bool table = kind == Kind::kAdjustedTable || kind == Kind::kFactoryTable;
  return table ? Compensation::kCalibration : Compensation::kNone;
}

/// How often a relation of a kind is the cause, relative to others: its places share it.
class Priors {
 public:
  explicit Priors(const std::vector<Relation>& all) {
    for (const Relation& relation : all) ++counts_[static_cast<std::size_t>(relation.kind)];
  }
  double Log(const Hypothesis& hypothesis) const {
    double log = hypothesis.size() > 1 ? kPairPrior : 0;
    for (const Relation& relation : hypothesis) {
      if (relation.kind == Kind::kNominal) log += kNominalPrior;
      log -= std::log(static_cast<double>(counts_[static_cast<std::size_t>(relation.kind)]));
    }
    return log;
  }

 private:
  std::array<int, kRelationKinds> counts_{};
};

/// Postures within the limits of the arm, with the loads and tools of the sample's.
std::vector<ControllerPosture> OtherPostures(const RelationContext& context,
                                             const ControllerSample& sample, int count) {
  std::vector<ControllerPosture> all;
  for (const model::JointVector& q : RandomPostures(context.cell.robot, count)) {
    ControllerPosture& posture =
        all.emplace_back(sample.postures[all.size() % sample.postures.size()]);
    posture.q = q;
    posture.qd = model::JointVector::Constant(q.size(), 0.1);
  }
  return all;
}

/// True if `b` can report what `a` reports in every posture.
bool Imitates(const RelationFitter& fitter, const HypothesisFit& a, const HypothesisFit& b) {
  const RelationContext& context = fitter.context();
  Hypothesis reading_a, reading_b, own_a, own_b;
  for (const Relation& one : a.hypothesis) (OfReading(one.kind) ? reading_a : own_a).push_back(one);
  for (const Relation& one : b.hypothesis) (OfReading(one.kind) ? reading_b : own_b).push_back(one);
  if (reading_a != reading_b) return false;
  ControllerSample same = fitter.sample();
  same.postures = OtherPostures(context, fitter.sample(), kTried / 2);
  same.convention = -1;
  same.joint_step = same.position_step = same.angle_step = 0;
  for (ControllerPosture& posture : same.postures) {
    const Pose X = fitter.ReportedAt(a, posture);
    posture.p = X.p;
    posture.R = X.R;
    posture.angles = VectorFromRotation(X.R);
  }
  const RelationFitter other(context, same);
  const HypothesisFit fit = other.Fit(own_b);
  return fit.chi_square <= fit.degrees;
}

/// True if a relation changes nothing in any posture, such as rounding a round table.
bool HasEffect(const RelationContext& context, const ControllerSample& sample,
               const Relation& relation, const std::vector<ControllerPosture>& others) {
  if (relation.kind != Kind::kRoundedTable && relation.kind != Kind::kOtherTool &&
      relation.kind != Kind::kFlange) {
    return true;
  }
  const RelationFitter fitter(context, sample);
  HypothesisFit nominal, changed;
  changed.hypothesis = {relation};
  return std::any_of(others.begin(), others.end(), [&](const ControllerPosture& posture) {
    return (fitter.ReportedAt(nominal, posture).p - fitter.ReportedAt(changed, posture).p).norm() >
           1e-9;
  });
}

std::vector<int> UnmovedJoints(const ControllerSample& sample) {
  std::vector<int> unmoved;
  for (int i = 0; i < sample.postures.front().q.size(); ++i) {
    double low = sample.postures.front().q[i], high = low;
    for (const ControllerPosture& posture : sample.postures) {
      low = std::min(low, posture.q[i]);
      high = std::max(high, posture.q[i]);
    }
    if (high - low < kMoved) unmoved.push_back(i);
  }
  return unmoved;
}

/// Share of the variance of whitened residuals that regressors explain, and the F statistic's size
/// relative to what chance gives.
struct Followed {
  std::string name;
  double share = 0, excess = 0;
};

std::vector<std::string> SignalsOf(const RelationFitter& fitter, const HypothesisFit& fit) {
  const ControllerSample& sample = fitter.sample();
  const auto count = std::ssize(sample.postures);
  const auto residuals = fitter.Residuals(fit);
  Eigen::MatrixXd targets = residuals.topRows<3>().transpose();
  for (int k = 0; k < 3; ++k) targets.col(k).array() -= targets.col(k).mean();
  std::vector<Followed> all;
  const auto add = [&](const std::string& name, const std::vector<Eigen::VectorXd>& columns) {
    Eigen::MatrixXd A(count, std::ssize(columns));
    for (std::size_t k = 0; k < columns.size(); ++k) {
      A.col(static_cast<int>(k)) = columns[k].array() - columns[k].mean();
      if (A.col(static_cast<int>(k)).norm() < 1e-9) return;
    }
    const Eigen::MatrixXd left = targets - A * A.colPivHouseholderQr().solve(targets);
    const double before = targets.squaredNorm(), after = left.squaredNorm();
    const double free = static_cast<double>(count - 1 - std::ssize(columns));
    if (!(before > 0) || free < 3) return;
    const double F =
        (before - after) / static_cast<double>(columns.size()) / (after / free + 1e-30);
    all.push_back({name, 1 - after / before, F});
  };
  const auto of = [&](const auto& value) {
    Eigen::VectorXd column(count);
    for (int k = 0; k < count; ++k) column[k] = value(sample.postures[static_cast<std::size_t>(k)]);
    return column;
  };
  for (int i = 0; i < sample.postures.front().q.size(); ++i) {
    add(fmt::format("joint {}", i + 1),
        {of([i](const ControllerPosture& one) { return std::sin(one.q[i]); }),
         of([i](const ControllerPosture& one) { return std::cos(one.q[i]); })});
  }
  const auto has = [&](auto member) {
    return std::all_of(sample.postures.begin(), sample.postures.end(),
                       [&](const ControllerPosture& one) { return (one.*member).has_value(); });
  };
  if (has(&ControllerPosture::payload))
    add("the payload", {of([](const ControllerPosture& one) { return one.payload->mass_kg; })});
  if (has(&ControllerPosture::temp_C))
    add("the temperature", {of([](const ControllerPosture& one) { return *one.temp_C; })});
  if (has(&ControllerPosture::t_s))
    add("the time", {of([](const ControllerPosture& one) { return *one.t_s; })});
  std::sort(all.begin(), all.end(),
            [](const Followed& a, const Followed& b) { return a.excess > b.excess; });
  std::vector<std::string> names;
  for (const Followed& one : all) {
    if (one.excess > 8 && one.share > 0.4 && names.size() < 2) {
      names.push_back(fmt::format("{} ({:.0f} % of it)", one.name, 100 * one.share));
    }
  }
  return names;
}

/// Joints that hardly moved may be radians that were read as degrees.
Identification OfJointUnit(const RelationContext& context, const ControllerSample& sample) {
  Identification found;
  found.postures = sample.postures.size();
  ControllerSample moved = sample;
  for (ControllerPosture& posture : moved.postures) posture.q *= kDegPerRad;
  if (std::ssize(UnmovedJoints(moved)) == sample.postures.front().q.size()) return found;
  const RelationFitter fitter(context, sample);
  const HypothesisFit fit = fitter.FitAndPredict({{.kind = Kind::kJointUnit, .value = kDegPerRad}});
  found.nominal = fitter.FitAndPredict({{}});
  if (!fit.Accepted() || found.nominal.Accepted()) return found;
  found.best = fit;
  found.verdict = Verdict::kNamed;
  found.unmoved = UnmovedJoints(moved);
  return found;
}

/// The search for the relation.
class Search {
 public:
  Search(const RelationContext& context, const ControllerSample& sample,
         const IdentifyProgress& progress)
      : fitter_(context, sample), progress_(progress) {
    const auto others = OtherPostures(context, sample, 5);
    for (const Relation& relation : RelationsOf(context, sample)) {
      if (HasEffect(context, sample, relation, others)) relations_.push_back(relation);
    }
  }

  Identification Run() {
    Identification found;
    found.postures = fitter_.sample().postures.size();
    found.unmoved = UnmovedJoints(fitter_.sample());
    found.nominal = fitter_.FitAndPredict({{}});
    found.best = found.nominal;
    std::vector<Hypothesis> singles;
    for (const Relation& one : relations_) singles.push_back({one});
    constexpr double kShareOfSingles = 0.05;
    std::vector<HypothesisFit> accepted = AcceptedOf(singles, 0, kShareOfSingles);
    // Two at once are rivals of one, above all of one with many values.
    for (HypothesisFit& fit : AcceptedOf(PairsBeside(accepted), kShareOfSingles, 1))
      accepted.push_back(std::move(fit));
    if (stopped_) return found;
    const Priors priors(relations_);
    std::stable_sort(accepted.begin(), accepted.end(),
                     [&](const HypothesisFit& a, const HypothesisFit& b) {
                       return ScoreOf(a, priors) > ScoreOf(b, priors);
                     });
    Decide(accepted, found);
    return found;
  }

  /// Postures without which the others have a relation in common; none if a relation that was found
  /// explains all postures with fewer values than those few have numbers.
  std::vector<OutlyingRow> OutlyingRows(const Identification& found) {
    const bool none = found.verdict == Verdict::kNone;
    const std::vector<Relation> nominal = {{}};
    const auto rows = FindOutlyingRows(fitter_, none ? relations_ : nominal, [this](double share) {
      stopped_ = stopped_ || (progress_ && !progress_(share, "postures that do not fit"));
      return !stopped_;
    });
    const auto numbers = std::ssize(rows) * (fitter_.sample().with_orientation ? 6 : 3);
    const auto explains = [numbers](const HypothesisFit& fit) {
      return fit.values.size() < numbers;
    };
    const bool explained =
        !none &&
        (explains(found.best) || std::any_of(found.rivals.begin(), found.rivals.end(), explains));
    return explained ? std::vector<OutlyingRow>() : rows;
  }

  bool stopped() const { return stopped_; }

 private:
  /// Every two relations but those that only extend an accepted one: beside it, nothing is left to
  /// explain.
  std::vector<Hypothesis> PairsBeside(const std::vector<HypothesisFit>& accepted) const {
    const auto is_accepted = [&](const Relation& one) {
      return std::any_of(accepted.begin(), accepted.end(),
                         [&](const HypothesisFit& fit) { return fit.hypothesis.front() == one; });
    };
    const bool nominal = is_accepted({});
    const auto has_values = [&](const Relation& one) {
      return !ParametersOf(one, fitter_.context(), fitter_.sample()).prior_sd.empty();
    };
    std::vector<Hypothesis> pairs;
    for (std::size_t i = 0; i < relations_.size(); ++i) {
      for (std::size_t j = i + 1; j < relations_.size(); ++j) {
        const Relation &a = relations_[i], &b = relations_[j];
        if (Exclude(a, b) || OnCycle(a, b) || is_accepted(a) || is_accepted(b)) continue;
        if (nominal && has_values(a) && has_values(b)) continue;
        pairs.push_back({a, b});
      }
    }
    return pairs;
  }

  /// True if two couplings, with those of the cell, leave a joint without an order.
  bool OnCycle(const Relation& a, const Relation& b) const {
    if (a.kind != Kind::kCoupling || b.kind != Kind::kCoupling) return false;
    const model::Robot& robot = fitter_.context().cell.robot;
    std::vector<model::JointCoupling> couplings = robot.couplings;
    for (const Relation* one : {&a, &b}) couplings.push_back({one->joint, one->other, 1.0});
    return std::ssize(kinematics::CouplingOrder(robot.size(), couplings)) < robot.size();
  }

  double ScoreOf(const HypothesisFit& fit, const Priors& priors) const {
    return fit.log_evidence + priors.Log(fit.hypothesis);
  }

  std::vector<HypothesisFit> AcceptedOf(const std::vector<Hypothesis>& hypotheses, double from,
                                        double to) {
    const Priors priors(relations_);
    std::vector<HypothesisFit> fits;
    for (std::size_t k = 0; k < hypotheses.size() && !stopped_; ++k) {
      if (progress_ && k % 16 == 0) {
        const double share = static_cast<double>(k) / static_cast<double>(hypotheses.size());
        stopped_ =
            !progress_(from + share * (to - from), to < 1 ? "single relations" : "two at once");
      }
      const HypothesisFit screened = fitter_.Fit(hypotheses[k], true);
      if (screened.chi_square > statistics::ChiSquareQuantile(kScreeningTail, screened.degrees)) {
        continue;
      }
      HypothesisFit fit = fitter_.Fit(hypotheses[k]);
      if (fit.chi_square <= statistics::ChiSquareQuantile(kScreeningTail, fit.degrees))
        fits.push_back(std::move(fit));
      if (!nearest_ || fit.chi_square < nearest_->chi_square) nearest_ = fit;
    }
    std::sort(fits.begin(), fits.end(), [&](const HypothesisFit& a, const HypothesisFit& b) {
      return ScoreOf(a, priors) > ScoreOf(b, priors);
    });
    if (fits.size() > kMostPredicted) fits.resize(kMostPredicted);
    std::vector<HypothesisFit> accepted;
    for (HypothesisFit& fit : fits) {
      fitter_.Predict(fit);
      if (fit.Accepted()) accepted.push_back(fit);
    }
    std::sort(accepted.begin(), accepted.end(),
              [&](const HypothesisFit& a, const HypothesisFit& b) {
                return ScoreOf(a, priors) > ScoreOf(b, priors);
              });
    return accepted;
  }

  void Decide(const std::vector<HypothesisFit>& accepted, Identification& found) {
    if (accepted.empty()) {
      found.verdict = Verdict::kNone;
      if (nearest_) {
        found.best = *nearest_;
        fitter_.Predict(found.best);
      }
      found.follows = SignalsOf(fitter_, found.nominal);
      return;
    }
    const Priors priors(relations_);
    found.best = accepted.front();
    for (std::size_t k = 1; k < accepted.size(); ++k) {
      const HypothesisFit& other = accepted[k];
      const bool near = ScoreOf(other, priors) > ScoreOf(found.best, priors) - kDecisive;
      const bool same = Imitates(fitter_, found.best, other);
      if (same && !OfModels(other)) found.same_as.push_back(other);
      if (near && !same && !SameAnswer(found.best, other)) found.rivals.push_back(other);
    }
    PreferFrames(found);
    found.verdict = found.rivals.empty() ? Verdict::kNamed : Verdict::kNotClear;
    if (!found.rivals.empty()) ProposePostures(found);
  }

  /// True if a hypothesis can imitate many others, so that it is no other name for them.
  static bool OfModels(const HypothesisFit& fit) {
    return std::any_of(fit.hypothesis.begin(), fit.hypothesis.end(), [](const Relation& one) {
      return one.kind == Kind::kAdjustedTable || one.kind == Kind::kJointCompliance;
    });
  }

  static bool SameAnswer(const HypothesisFit& a, const HypothesisFit& b) {
    const auto of_deflection = [](const HypothesisFit& fit) {
      return fit.hypothesis.size() == 1 && (fit.hypothesis[0].kind == Kind::kCellDeflection ||
                                            fit.hypothesis[0].kind == Kind::kJointCompliance);
    };
    return of_deflection(a) && of_deflection(b);
  }

  /// Of relations that are the same in every posture, one with fewer dimensions of the arm is the
  /// better name: tools and bases are set by hand, arms are not.
  static void PreferFrames(Identification& found) {
    const auto dimensions = [](const HypothesisFit& fit) {
      return std::count_if(fit.hypothesis.begin(), fit.hypothesis.end(),
                           [](const Relation& one) { return one.kind == Kind::kTableValue; });
    };
    for (HypothesisFit& same : found.same_as) {
      if (same.hypothesis.size() <= found.best.hypothesis.size() &&
          dimensions(same) < dimensions(found.best)) {
        std::swap(same, found.best);
      }
    }
  }

  /// Postures in which the best explanation and the next one differ most, apart from one another.
  void ProposePostures(Identification& found) const {
    std::vector<std::pair<double, model::JointVector>> ranked;
    for (const ControllerPosture& posture :
         OtherPostures(fitter_.context(), fitter_.sample(), kTried)) {
      ranked.emplace_back(-fitter_.Separation(found.best, found.rivals.front(), posture),
                          posture.q);
    }
    std::sort(ranked.begin(), ranked.end(),
              [](const auto& a, const auto& b) { return a.first < b.first; });
    for (const auto& [separation, q] : ranked) {
      const bool apart =
          std::all_of(found.next.begin(), found.next.end(),
                      [&q = q](const auto& one) { return (one - q).cwiseAbs().maxCoeff() > 0.5; });
      if (apart && found.next.size() < kNext && separation < -9) found.next.push_back(q);
    }
  }

  RelationFitter fitter_;
  const IdentifyProgress& progress_;
  std::vector<Relation> relations_;
  std::optional<HypothesisFit> nearest_;
  bool stopped_ = false;
};

}  // namespace

bool Identification::IsNominal() const {
  return verdict == Verdict::kNamed && best.hypothesis.size() == 1 &&
         (best.hypothesis[0].kind == Kind::kNominal ||
          best.hypothesis[0].kind == Kind::kDeclaredFrame);
}

Compensation Identification::compensation() const {
  if (verdict != Verdict::kNamed) return Compensation::kNone;
  Compensation all = Compensation::kNone;
  for (const Relation& one : best.hypothesis) all = std::max(all, Compensates(one.kind));
  return all;
}

Overlap OverlapOf(const RelationContext& context, const ControllerSample& sample,
                  const Identification& found) {
  Overlap overlap;
  const std::ptrdiff_t count = std::ssize(sample.postures);
  if (found.compensation() == Compensation::kNone || count < 5) return overlap;
  const RelationFitter fitter(context, sample);
  HypothesisFit nominal, adds;  // `adds`: without what changes frames, joints and units
  std::vector<double> values;
  std::ptrdiff_t at = 0;
  for (const Relation& one : found.best.hypothesis) {
    const std::ptrdiff_t size = std::ssize(ParametersOf(one, context, sample).prior_sd);
    if (Compensates(one.kind) != Compensation::kNone) {
      adds.hypothesis.push_back(one);
      values.insert(values.end(), found.best.values.data() + at,
                    found.best.values.data() + at + size);
    }
    at += size;
  }
  adds.values = Eigen::Map<Eigen::VectorXd>(values.data(), std::ssize(values));
  Eigen::Matrix3Xd added(3, count), corrected(3, count);
  for (std::ptrdiff_t k = 0; k < count; ++k) {
    const ControllerPosture& posture = sample.postures[static_cast<std::size_t>(k)];
    added.col(k) = fitter.ReportedAt(adds, posture).p - fitter.ReportedAt(nominal, posture).p;
    effects::Conditions conditions;
    conditions.temp_C = posture.temp_C;
    deflection::LoadedState state;
    if (!context.arm.AtCommanded(posture.q, LoadOf(posture), conditions, state)) return overlap;
    corrected.col(k) = state.X_BT.p - context.arm.UnloadedTip(posture.q, posture.tool).p;
  }
  added.colwise() -= Vec3(added.rowwise().mean());
  corrected.colwise() -= Vec3(corrected.rowwise().mean());
  const double size = added.norm() * corrected.norm();
  if (!(corrected.norm() > kFloorOfCorrection_m * std::sqrt(static_cast<double>(count))) ||
      !(size > 0)) {
    return overlap;
  }
  overlap.correlation = added.cwiseProduct(corrected).sum() / size;
  // Fisher's transformation; the three coordinates of a posture count as one observation, because
  // deflection has one direction.
  const double z =
      std::atanh(std::clamp(overlap.correlation, -kLargestCorrelation, kLargestCorrelation));
  overlap.at_least = std::tanh(z - kSureDeviations / std::sqrt(static_cast<double>(count) - 3));
  return overlap;
}

bool CompensatedTwice(const RelationContext& context, const ControllerSample& sample,
                      const Identification& found) {
  const double at_least = OverlapOf(context, sample, found).at_least;
  return at_least > 0 && at_least * at_least > 0.5;
}

bool Contradicts(const RelationContext& context, const ControllerSample& sample,
                 const HypothesisFit& fit, const ControllerPosture& posture) {
  const double degrees = sample.with_orientation ? 6 : 3;
  return RelationFitter(context, sample).Surprise(fit, posture) >
         statistics::ChiSquareQuantile(kScreeningTail, degrees);
}

std::optional<PoseError> UnexplainedDifference(const RelationContext& context,
                                               const ControllerSample& sample) {
  if (sample.postures.empty()) return std::nullopt;
  const RelationFitter fitter(context, sample);
  HypothesisFit nominal;
  nominal.hypothesis = {{}};
  const Eigen::VectorXd residuals = fitter.WhitenedResiduals(nominal);
  const double limit =
      statistics::ChiSquareQuantile(kScreeningTail, static_cast<double>(residuals.size()));
  if (residuals.squaredNorm() <= limit) return std::nullopt;
  const auto errors = fitter.Residuals(nominal);
  const auto count = static_cast<double>(errors.cols());
  return PoseError{errors.topRows<3>().norm() / std::sqrt(count),
                   errors.bottomRows<3>().norm() / std::sqrt(count)};
}

Identification Identify(const RelationContext& context, const ControllerSample& sample,
                        const IdentifyProgress& progress) {
  Identification found;
  found.postures = sample.postures.size();
  if (sample.postures.size() < kFewestPostures) return found;
  if (std::ssize(UnmovedJoints(sample)) == sample.postures.front().q.size())
    return OfJointUnit(context, sample);
  Search search(context, sample, progress);
  found = search.Run();
  if (found.verdict == Verdict::kTooFew || found.IsNominal()) return found;
  const std::vector<OutlyingRow> outlying = search.OutlyingRows(found);
  if (search.stopped()) found.verdict = Verdict::kTooFew;
  if (search.stopped() || outlying.empty()) return found;
  const ControllerSample others = Without(sample, outlying);
  if (std::ssize(UnmovedJoints(others)) < others.postures.front().q.size())
    found = Search(context, others, progress).Run();
  else
    found.verdict = Verdict::kNotClear;
  found.outlying = outlying;
  return found;
}

}  // namespace plumbline::measure
