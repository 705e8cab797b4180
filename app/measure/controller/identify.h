// Identification of the model that a controller uses, from postures and reported tool poses.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "app/measure/controller/relation_fit.h"

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
  std::size_t postures = 0;

  bool IsNominal() const;
  /// What the named relation adds to the cell's rigid table.
  Compensation compensation() const;
};

/// True if the cell corrects what the controller's pose already contains.
bool CompensatedTwice(const model::CellModel& cell, const Identification& found);

/// How far the reported poses are from the cell's rigid table, if rounding does not explain it. One
/// posture suffices.
std::optional<PoseError> UnexplainedDifference(const RelationContext& context,
                                               const ControllerSample& sample);

/// @param progress  called with the share done; returns false to stop, and the verdict is kTooFew
using IdentifyProgress = std::function<bool(double share, const std::string& doing)>;

/// Names the relation between the poses that a controller reports and a cell: each relation, and
/// each two if no single one does, is fitted to one half of the postures and has to predict the
/// other within the resolution of the numbers. Those that do are compared by their evidence; one is
/// named if it is a thousand times as probable as every other that differs from it in any posture.
/// Pure.
Identification Identify(const RelationContext& context, const ControllerSample& sample,
                        const IdentifyProgress& progress = {});

}  // namespace plumbline::measure
