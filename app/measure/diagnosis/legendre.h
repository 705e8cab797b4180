// Legendre polynomials of a recorded signal.
#pragma once

#include "app/measure/diagnosis/dataset.h"

namespace plumbline::measure {

/// Legendre polynomial P_degree of x in -1..1.
double Legendre(int degree, double x);

/// A value of the signal scaled so that its range over the rows is -1..1.
double Scaled(const RecordedSignal& signal, double value);

}  // namespace plumbline::measure
