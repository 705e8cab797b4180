#include "app/measure/diagnosis/legendre.h"

namespace plumbline::measure {

double Legendre(int degree, double x) {
  double previous = 1, current = x;
  if (degree == 0) return 1;
  for (int k = 1; k < degree; ++k) {
    const double next = ((2 * k + 1) * x * current - k * previous) / (k + 1);
    previous = current;
    current = next;
  }
  return current;
}

double Scaled(const RecordedSignal& signal, double value) {
  return 2 * (value - signal.low) / (signal.high - signal.low) - 1;
}

}  // namespace plumbline::measure
