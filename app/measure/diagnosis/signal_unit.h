// Unit and label of a recorded signal, from its column name.
#pragma once

#include <string>
#include <string_view>

namespace plumbline::measure {

/// "bar" for "air_pressure_bar", "deg/s" for "qd2_deg_s", "unit of counter" for "counter".
/// Temperature differences are in K.
std::string UnitOfSignal(std::string_view column);

/// The column as text with its unit: "q5 (deg)" for "q5_deg", "time (s)" for "t_s", "air pressure
/// (bar)" for "air_pressure_bar". The column itself if it does not end with a known unit.
std::string SignalLabel(std::string_view column);

}  // namespace plumbline::measure
