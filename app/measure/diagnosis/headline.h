// Headline of a diagnosis: the verdict in one sentence, and the errors before and after correction.
#pragma once

#include <string>

#include "app/measure/diagnosis/diagnosis.h"

namespace plumbline::measure {

/// The verdict in one sentence, without a capital at its start and without a full stop.
std::string Headline(const Diagnosis& diagnosis);

/// RMS error before and after the correction, and on which points; empty if there are no findings.
std::string ErrorSentence(const Diagnosis& diagnosis);

}  // namespace plumbline::measure
