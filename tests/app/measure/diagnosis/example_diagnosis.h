// Handmade diagnoses of a simulated measurement, one for each verdict.
#pragma once

#include "app/measure/diagnosis/result/diagnosis.h"

namespace plumbline::test {

/// The cell of the examples: HeavyArm with a name to display.
model::CellModel ExampleCell();

/// kExplained: compliance of joints 2 and 3, with thermal growth; kNoEffect: noise only;
/// kAmbiguous: tool stiffness against payload mass; kUnknown: a compliance, and the base follows
/// air_pressure_bar. 96 rows in two sessions, two of them outliers, sigma 0.05 mm.
measure::Diagnosis ExampleDiagnosis(measure::Verdict verdict);

}  // namespace plumbline::test
