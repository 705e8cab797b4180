// Identification of the model that a controller uses, from postures and reported tool poses.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "app/measure/controller/outlying_rows.h"

namespace plumbline::measure {

/// What a controller's reported pose already contains.
enum class Compensation { kNone, kCalibration, kDeflection };

/// Postures that an identification needs, and those that are kept.
inline constexpr std::size_t kFewestPostures = 6, kUsualPostures = 20;

struct Identification {
  enum class Verdict {
    kNamed,     ///< `best` is the relation
    kNotClear,  ///< `best` and `rivals` explain the postures
    kNone,      ///< no relation, and no two, explain the postures
    kTooFew,    ///< fewer than kFewestPostures postures, or the arm hardly moved
  };
  Verdict verdict = Verdict::kTooFew;
  HypothesisFit nominal;  ///< for comparison
  HypothesisFit best;
  std::vector<HypothesisFit> rivals;  ///< if the verdict is kNotClear
  /// Relations that describe the same controller as `best`, in every posture.
  std::vector<HypothesisFit> same_as;
  std::vector<model::JointVector> next;  ///< postures that separate the rivals
  /// Of kNone: signals that the remaining residual follows, strongest first.
  std::vector<std::string> follows;
  std::vector<int> unmoved;  ///< joints that hardly moved, so that nothing is known of them
  /// Postures that do not fit the others: everything else is about the others.
  std::vector<OutlyingRow> outlying;
  std::size_t postures = 0;  ///< without those

  bool IsNominal() const;
  /// What the named relation adds to the cell's rigid table.
  Compensation compensation() const;
};

/// How alike are the tip displacements that a named relation adds and those that the cell corrects,
/// over the postures of the sample and without their means: correlation, and its lower bound
/// at 99.9 % by Fisher's transformation. Both 0 if the relation compensates nothing, or the cell
/// corrects nothing under the conditions of the postures.
struct Overlap {
  double correlation = 0, at_least = 0;
};
Overlap OverlapOf(const RelationContext& context, const ControllerSample& sample,
                  const Identification& found);

/// True if the controller's pose already contains what the cell corrects: at least half of the
/// variance is common, by the lower bound of the overlap.
bool CompensatedTwice(const RelationContext& context, const ControllerSample& sample,
                      const Identification& found);

/// True if a posture that is not of the sample is not reported as a relation that was fitted to the
/// sample predicts, by more than the resolution and the uncertainty of the fit explain.
bool Contradicts(const RelationContext& context, const ControllerSample& sample,
                 const HypothesisFit& fit, const ControllerPosture& posture);

/// How far the reported poses are from the cell's rigid table, if rounding does not explain it. One
/// posture suffices.
std::optional<PoseError> UnexplainedDifference(const RelationContext& context,
                                               const ControllerSample& sample);

/// @param progress  called with the share done; returns false to stop, and the verdict is kTooFew
using IdentifyProgress = std::function<bool(double share, const std::string& doing)>;

/// Names the relation between the poses that a controller reports and a cell. Each relation, and
/// each two of which none suffices alone, is fitted to one half of the postures; it is accepted if
/// it predicts the other half within the resolution of the numbers, with values that its prior
/// allows. The accepted ones are compared by their evidence; one is named if it is a thousand times
/// as probable as every other accepted one that differs from it in any posture. Two descriptions of
/// deflection count as one. If none is accepted, or only one with as many values as a few postures
/// have numbers, those few are left out where the others have a relation in common. Pure.
Identification Identify(const RelationContext& context, const ControllerSample& sample,
                        const IdentifyProgress& progress = {});

}  // namespace plumbline::measure
