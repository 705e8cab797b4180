// Unit of a recorded signal, from the end of its column name.
#pragma once

#include <string>
#include <string_view>

namespace plumbline::diagnosis {

/// "bar" for "air_pressure_bar", "deg/s" for "qd2_deg_s", "unit of counter" for "counter".
/// Temperature differences are in K.
std::string UnitOfSignal(std::string_view column);

}  // namespace plumbline::diagnosis
