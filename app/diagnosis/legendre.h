// A smooth curve along a recorded signal, by its polynomials.
#pragma once

#include "app/diagnosis/dataset.h"

namespace plumbline {

/// Legendre polynomial P_degree of x in -1..1.
double Legendre(int degree, double x);

/// The signal's value of a row scaled to -1..1 over the rows.
double Scaled(const RecordedSignal& signal, double value);

}  // namespace plumbline
