#include "app/measure/diagnosis/result/opinion.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace plumbline::measure {
namespace {

/// The enumeration is in the order from the strongest to the weakest.
Verdict WeakerOf(Verdict a, Verdict b) {
  static_assert(Verdict::kNoEffect < Verdict::kExplained &&
                Verdict::kExplained < Verdict::kAmbiguous &&
                Verdict::kAmbiguous < Verdict::kUnknown);
  return std::max(a, b);
}

template <typename T>
void Append(std::vector<T> from, std::vector<T>& to) {
  std::ranges::move(from, std::back_inserter(to));
}

}  // namespace

void FoldOpinions(std::vector<Opinion> opinions, Diagnosis& diagnosis) {
  for (Opinion& opinion : opinions) {
    if (!opinion.doubts.empty()) opinion.permits = WeakerOf(opinion.permits, Verdict::kAmbiguous);
    diagnosis.verdict = WeakerOf(diagnosis.verdict, opinion.permits);
    Append(std::move(opinion.checks), diagnosis.checks);
    Append(std::move(opinion.doubts), diagnosis.doubts);
    Append(std::move(opinion.rivals), diagnosis.rivals);
    Append(std::move(opinion.notes), diagnosis.notes);
    for (std::string& driver : opinion.drivers) {
      if (std::ranges::find(diagnosis.drivers, driver) == diagnosis.drivers.end())
        diagnosis.drivers.push_back(std::move(driver));
    }
    if (opinion.misfit) diagnosis.misfit = opinion.misfit;
    if (diagnosis.withheld.empty()) diagnosis.withheld = opinion.withheld;
    diagnosis.declared_noise_too_small |= opinion.noise_too_small;
  }
}

}  // namespace plumbline::measure
