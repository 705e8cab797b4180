// Whether a correction is written although a declared value contradicts it.
#include "app/measure/diagnosis/hypotheses/contradictions.h"

#include <catch2/catch.hpp>

#include "tests/app/measure/diagnosis/example_diagnosis.h"

namespace plumbline::contradictions_test {

using namespace plumbline::measure;

/// An explanation of rows with an error of 2 mm, contradicted by one of five references.
Diagnosis Checked(double with_effects_m, double declared_m, double largest_m) {
  Diagnosis diagnosis = test::ExampleDiagnosis(Verdict::kExplained);
  diagnosis.withheld.clear();
  diagnosis.rms_before_m = 2e-3;
  TestedReferences tested;
  tested.references.tested = 5;
  tested.references.contradicting.push_back({{0, {}}, 9, "a distance is wrong"});
  tested.with_effects_m = with_effects_m;
  tested.declared_m = declared_m;
  tested.largest_m = largest_m;
  FoldOpinions({OpinionOnContradictions(tested, diagnosis)}, diagnosis);
  return diagnosis;
}

TEST_CASE("a contradicted correction is written only if references and rows gain more by it") {
  struct Case {
    double with_effects_m, declared_m, largest_m;
    bool written;
  };
  const Case cases[] = {
      {0.4e-3, 1e-3, 0.9e-3, true},
      {0.6e-3, 1e-3, 0.9e-3, false},  // does not halve the error at the references
      {0.4e-3, 1e-3, 1.1e-3, false},  // may mislead by more than half of the rows' error
  };
  for (const Case& one : cases) {
    CAPTURE(one.with_effects_m, one.largest_m);
    const Diagnosis diagnosis = Checked(one.with_effects_m, one.declared_m, one.largest_m);
    CHECK(diagnosis.withheld.empty() == one.written);
    CHECK(diagnosis.doubts.size() >= diagnosis.findings.size());  // doubtful in any case
  }
}

}  // namespace plumbline::contradictions_test
