// Terminal summary of a diagnosis.
#pragma once

#include <optional>
#include <string>

#include "app/measure/diagnosis/result/diagnosis.h"

namespace plumbline::measure {

/// The verdict in one sentence, without a capital at its start and without a full stop.
std::string Headline(const Diagnosis& diagnosis);

/// RMS error before and after the correction, and on which points; empty if there are no findings.
std::string ErrorSentence(const Diagnosis& diagnosis);

/// What the caller of a diagnosis adds to its summary.
struct SummaryContext {
  const model::CellModel& cell;
  std::optional<double> tolerance_m{};  ///< largest permitted error of a measured pose
  std::string next_step{};              ///< what to do next, as a sentence or a command
  bool details = false;
};

/// The answer in one minute: the verdict in one sentence, the error before and after, what to do
/// next, and the size of each effect at the tip; then what keeps the verdict from being better, and
/// the poses that would decide it. At most 12 lines if explained, 18 otherwise. With `details` also
/// every parameter, rival, doubt and note, and the signals that were not recorded.
std::string SummaryText(const Diagnosis& diagnosis, const SummaryContext& context);

}  // namespace plumbline::measure
