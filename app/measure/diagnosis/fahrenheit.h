// Detection of temperatures recorded in degrees Fahrenheit.
#pragma once

#include <optional>

#include "app/measure/diagnosis/mistakes.h"

namespace plumbline::measure {

/// Adds a note if temp_C, in all rows or in some, is hotter than a cell usually is, but an ordinary
/// temperature when read as degrees Fahrenheit.
void NoteLikelyFahrenheit(MeasuredTable& table);

/// The hypothesis that these temperatures are in degrees Fahrenheit; nullopt if there are none.
/// Whether it is right is for the fit to decide: motors and heated cells do get that hot.
std::optional<Mistake> FahrenheitMistake(const Dataset& data);

}  // namespace plumbline::measure
