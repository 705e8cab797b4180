// The steps of Diagnose(), each defined in a file of its own.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "app/measure/diagnosis/diagnosis.h"
#include "app/measure/diagnosis/diagnosis_stages.h"
#include "app/measure/diagnosis/findings.h"
#include "app/measure/diagnosis/identify.h"
#include "app/measure/diagnosis/search.h"

namespace plumbline::measure {

// Detection of mistakes in the cell or the file that are hidden by an effect.

using Progress = std::function<void(double, const std::string&)>;

/// Looks for a mistake that moves the tip less than effects do (Mistake::subtle). It is reported if
/// correcting it leads to a sound explanation (no implausible value, no empirical term, residual
/// within the declared noise) that is better by kMistakeMargin than the explanation of the
/// uncorrected rows. Both are searched on at most 300 rows, and only if correcting the mistake
/// already improves the fit of the answer's effects, and by more than an alternative change.
/// @param found     the answer for the uncorrected rows, or for an evenly spaced subset of them
/// @param data      all rows
/// @param progress  completed share 0..1 and current activity
/// @return          the mistake and a remedy; nullopt if no known mistake explains the rows better
std::optional<std::string> HiddenMistake(const Identified& found, const Dataset& data,
                                         const DiagnosisOptions& options, const Progress& progress);

/// Looks for a column whose unit changes (UnitChanges), and for temperatures in Fahrenheit, before
/// the main search, which would be slow: no small number of effects fits the rows as read. A change
/// is reported if the converted rows have a sound explanation, and neither the rows as read with as
/// many effects nor an alternative conversion factor comes within kMistakeMargin of it. Searches
/// only if the numbers of the column suggest a change, on at most 300 rows.
/// @return  the mistake and a remedy; nullopt if there is none
std::optional<std::string> HiddenUnitChange(const Dataset& data, const DiagnosisOptions& options,
                                            const Progress& progress);

// Proposal of further measurements that separate rival explanations.

/// Proposes poses in the order of execution, the most informative first (`SequentialDesign`). Uses
/// the measured payloads if these separate all explanations; otherwise some poses are proposed
/// without payload, and a note says so. Another note names rivals that no pose separates.
/// @param answer, rivals  explanations, as columns of `candidate_set`; the scores of the rivals are
///                        those of their nonlinear refits
/// @param diagnosis       receives rival_separations, next_poses, next_poses_separate_all and notes
void AddNextPoses(const CandidateSet& candidate_set, const Model& model,
                  const PerRow<double>& weights, const Explanation& answer,
                  const std::vector<Explanation>& rivals, const DiagnosisOptions& options,
                  Diagnosis& diagnosis);

// Detection limits: the smallest detectable value of each effect, and what the rows cannot show.

/// What the rows can show: the smallest detectable size of each effect, and what they cannot show.
struct DetectionLimits {
  std::map<std::string, double> minimum_detectable_m;  ///< 3-D RMS over the rows, by id
  std::vector<NotObservable> not_observable;
};

/// The smallest 3-D RMS displacement over the rows [m] at which an effect is detected with power
/// 0.9, in the worst case over its joints, directions and variants:
///   size = max over columns of (sqrt(cost) + 1.28) rms(column) / |projected column|
/// where the column is whitened and projected orthogonally to the free frames, and `cost` is the
/// score that naming the effect costs (for a searched shape, including the search over all shapes).
/// A joint or direction that would require a value beyond the plausible range is undetectable: it
/// is excluded from the maximum and is not observable. Of the shapes, those that the search
/// proposed are evaluated, and one and two cycles per turn of every joint.
DetectionLimits DetectionLimitsOf(const CandidateSet& candidate_set, const Candidates& candidates);

// Other recorded signals that could drive an empirical term equally well.

/// Replaces each driver of an empirical term by every other recorded signal, refits, and adds the
/// alternatives that the rows do not rule out (kRivalGap) to the rivals of the diagnosis. If time
/// and temperature rise together, for example, both are reported.
/// @param candidate_set  extended by the blocks of the alternatives
/// @param best           explanation, as columns of `candidate_set`; nothing is added if it has no
///                       empirical term
void AddDriverRivals(CandidateSet& candidate_set, const Explanation& best, Diagnosis& diagnosis);

// The model that a diagnosis writes: validated by held-out rows, with a discrepancy model where it
// helps, or withheld.

/// Validates the model by held-out rows and decides which parts of it are written.
Result<CorrectedModel> Validated(const Task& task, const Identified& found, const FitOfAllRows& fit,
                                 Diagnosis& diagnosis);

/// Removes the correction if it must not be written.
void Withhold(const FittedModel& declared, CorrectedModel& corrected, Diagnosis& diagnosis);

// Rival explanations that the rows cannot rule out.

/// Refits the other ranked explanations that replace some finding, and adds those within kRivalGap
/// of the answer to `diagnosis.rivals`.
/// @return  the added explanations, with the scores of their nonlinear refits
std::vector<Explanation> AddRivals(const FindingsContext& context, const Model& model,
                                   Diagnosis& diagnosis);

// The frames of a written model, the domain that it was validated in, and the errors stated there.

/// Adds the frames and the domain in which the written model was validated.
void AddDomain(const Task& task, const Identified& found, const FittedModel& declared,
               const FitOfAllRows& fit, const CorrectedModel& corrected, Diagnosis& diagnosis);

/// Every effect of the catalogue with the share that it explains alone and the reason why it was
/// selected or rejected.
/// @param rivals  of the answer
std::vector<CandidateOutcome> CandidateOutcomes(const FindingsContext& context,
                                                const Candidates& candidates,
                                                const std::vector<Rival>& rivals);

}  // namespace plumbline::measure
