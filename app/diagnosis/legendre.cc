#include "app/diagnosis/legendre.h"

namespace plumbline {

double Legendre(int degree, double x) {
  double before = 1, now = x;
  if (degree == 0) return 1;
  for (int k = 1; k < degree; ++k) {
    const double next = ((2 * k + 1) * x * now - k * before) / (k + 1);
    before = now;
    now = next;
  }
  return now;
}

double Scaled(const RecordedSignal& signal, double value) {
  return 2 * (value - signal.low) / (signal.high - signal.low) - 1;
}

}  // namespace plumbline
