#include "tests/virtual_cell/tracker.h"

namespace virtual_cell {
Tracker::Tracker(double noise_mm, std::vector<Vec3> reflectors_T, bool noise_of_standstill,
                 unsigned seed)
    : noise_mm_(noise_mm),
      reflectors_T_(std::move(reflectors_T)),
      noise_of_standstill_(noise_of_standstill),
      seed_(seed),
      random_(seed) {
  reflectors_T_.resize(4, Vec3::Zero());
}

void Tracker::SetPoint(int at, const Vec3& p_W) {
  for (int k = 0; k < 3; ++k) {
    bank_.SetFloat(at + 2 * k, p_W[k] * 1e3 + noise_mm_ * normal_(random_));
  }
}

void Tracker::Measure(const Truth& truth, const WorldInputs& now, bool at_rest) {
  if (at_rest && !at_rest_) ++standstills_;
  at_rest_ = at_rest;
  if (noise_of_standstill_ && at_rest) {
    std::seed_seq of_standstill{seed_, standstills_};
    random_.seed(of_standstill);
    normal_.reset();
  }
  SetPoint(0, truth.X_WT.translation());
  const Vec3 rotation = VectorFromRotation(truth.X_WT.linear());
  for (int k = 0; k < 3; ++k) bank_.SetFloat(6 + 2 * k, rotation[k]);
  bank_.SetWord(12, ++counter_);
  bank_.SetWord(13, at_rest ? 1 : 0);
  bank_.SetFloat(14, now.time_s);
  for (int i = 0; i < 4; ++i) {
    SetPoint(16 + 6 * i, truth.X_WT * reflectors_T_[static_cast<std::size_t>(i)]);
  }
  bank_.SetFloat(40, now.payload_kg);
}

}  // namespace virtual_cell
