// Registers from 1100: the dial gauges, a block each.
#include <algorithm>
#include <array>
#include <cmath>

#include "drivers/plc/register_map.h"
#include "firmware-like/geometry/units.h"

namespace plumbline::plc {
namespace {

using GaugeSource = const MapSource&;

constexpr double kLargestAge = 4294967295;  // of a u32

/// Two characters of the name, the first in the high byte.
template <int K>
double NameWord(GaugeSource s) {
  const auto code = [&](std::size_t at) {
    return static_cast<unsigned>(static_cast<unsigned char>(s.gauge->name[at]));
  };
  return static_cast<double>(code(2U * K) << 8U | code(2U * K + 1));
}

double AgeOf(GaugeSource s, double time_s, double units_per_s) {
  const double age = std::floor(units_per_s * (s.environment.now_s - time_s));
  return std::clamp(age, 0.0, kLargestAge);
}

const std::array kGaugeFields = {
    MapField{0, FieldType::kU16, "gauge_state", "code",
             "0 no gauge, 1 connected, 2 not connected since the start, 3 connection lost, "
             "reconnecting",
             [](GaugeSource s) { return static_cast<double>(s.gauge->state); }},
    MapField{1, FieldType::kU16, "gauge_artefact", "",
             "number of its artefact in the cell's list, from 1",
             [](GaugeSource s) -> double { return s.gauge->artefact; }},
    MapField{2, FieldType::kFloat, "gauge_reading", "mm",
             "latest reading, recorded or not; 0 if there is none (gauge_age)",
             [](GaugeSource s) { return kMmPerMetre * s.gauge->reading_m.value_or(0); }},
    MapField{4, FieldType::kU32, "gauge_age", "ms",
             "age of the latest reading; 4294967295: older than that, or none yet",
             [](GaugeSource s) {
               return s.gauge->reading_m ? AgeOf(s, s.gauge->reading_s, 1e3) : kLargestAge;
             }},
    MapField{6, FieldType::kU32, "gauge_state_age", "s", "time for which gauge_state has lasted",
             [](GaugeSource s) {
               const bool any = s.gauge->state != status::GaugeState::kNone;
               return any ? AgeOf(s, s.gauge->since_s, 1) : 0;
             }},
    MapField{8, FieldType::kU16, "gauge_name_1", "",
             "name of its artefact: two characters, the first in the high byte; 0: end",
             NameWord<0>},
    MapField{9, FieldType::kU16, "gauge_name_2", "", "", NameWord<1>},
    MapField{10, FieldType::kU16, "gauge_name_3", "", "", NameWord<2>},
    MapField{11, FieldType::kU16, "gauge_name_4", "", "", NameWord<3>},
    MapField{12, FieldType::kU16, "gauge_name_5", "", "", NameWord<4>},
    MapField{13, FieldType::kU16, "gauge_name_6", "", "", NameWord<5>},
    MapField{14, FieldType::kU16, "gauge_name_7", "", "", NameWord<6>},
    MapField{15, FieldType::kU16, "gauge_name_8", "", "", NameWord<7>},
    MapField{16, FieldType::kU16, "gauge_name_9", "", "", NameWord<8>},
    MapField{17, FieldType::kU16, "gauge_name_10", "", "", NameWord<9>},
    MapField{18, FieldType::kU16, "gauge_name_11", "", "", NameWord<10>},
    MapField{19, FieldType::kU16, "gauge_outcome", "code",
             "what became of the latest press: 0 none yet, 1 recorded, 2 unreadable data, 3 the "
             "gauge reported a fault, 4 not recorded because it sends without a press, 5 the "
             "control cycle did not answer, 6 waiting for the journal, 7 discarded before it was "
             "written; above 100 refused with the code minus 100, as in result_code",
             [](GaugeSource s) { return static_cast<double>(s.gauge->outcome); }},
};

}  // namespace

std::span<const MapField> registers::GaugeFields() {
  return kGaugeFields;
}

}  // namespace plumbline::plc
