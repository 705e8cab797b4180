#include "app/programs/correction/program_correction.h"

#include "app/programs/correction/point_correction.h"
#include "app/programs/correction/segments.h"

namespace plumbline::programs {

class ProgramCorrector::Implementation {
 public:
  Implementation(const Brand& brand, const Program& program, const model::CellModel& cell,
                 const CorrectionSettings& settings)
      : arm_(brand, program, cell, settings),
        flow_(FlowOf(program, settings.entry)),
        ends_(arm_, flow_, settings.start_q) {}

  ProgramCorrection Correct(const ProgressFunction& progress) {
    ProgramCorrection result;
    result.flow = flow_;
    constexpr double kPostures = 0.5;  // their share of the work
    const auto at = [&](double share) { return !progress || progress(share); };
    if (!ends_.Find([&](double share) { return at(kPostures * share); })) return result;
    PointCorrector corrector(arm_, ends_);
    const std::size_t count = arm_.program().points.size();
    for (std::size_t k = 0; k < count; ++k) {
      const double share = static_cast<double>(k) / static_cast<double>(count);
      if (!at(kPostures + (1 - kPostures) * share)) return result;
      result.points.push_back(corrector.Correct(k));
    }
    KeepArcsWhole(arm_.program(), flow_, result.points);
    return result;
  }

  void CheckSegments(const std::optional<double>& bound_m, ProgramCorrection& correction) {
    SegmentChecker checker(arm_, ends_);
    for (std::size_t m = 0; m < flow_.motions.size(); ++m) checker.Check(m, bound_m, correction);
  }

 private:
  ProgramArm arm_;
  const Flow flow_;
  MotionEnds ends_;
};

ProgramCorrector::ProgramCorrector(const Brand& brand, const Program& program,
                                   const model::CellModel& cell, const CorrectionSettings& settings)
    : implementation_(std::make_unique<Implementation>(brand, program, cell, settings)) {}

ProgramCorrector::~ProgramCorrector() = default;

ProgramCorrection ProgramCorrector::Correct(const ProgressFunction& progress) {
  return implementation_->Correct(progress);
}

void ProgramCorrector::CheckSegments(const std::optional<double>& bound_m,
                                     ProgramCorrection& correction) {
  implementation_->CheckSegments(bound_m, correction);
}

}  // namespace plumbline::programs
