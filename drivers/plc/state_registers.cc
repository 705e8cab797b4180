// Registers 0-25: identity of the map, state of the daemon.
#include <array>
#include <cmath>

#include "drivers/plc/register_values.h"

namespace plumbline::plc {
namespace {

using enum FieldType;

const std::array kStateFields = {
    // 0-9 identity
    MapField{0, kU16, "magic", "", "always 0x504C (\"PL\"): identifies Plumbline",
             [](Source) -> double { return registers::kMagic; }},
    MapField{1, kU16, "map_version", "", "version of this register map",
             [](Source) -> double { return registers::kVersion; }},
    MapField{2, kU16, "word_order", "",
             "order of the two words of a 32-bit value: 0 ABCD (high word first), 1 CDAB (low word "
             "first)",
             [](Source s) -> double { return s.convention.little_word_first ? 1 : 0; }},
    MapField{3, kU16, "orientation", "",
             "meaning of rx, ry, rz: 0 rotation vector, 1 roll-pitch-yaw (R = Rz(rz) Ry(ry) "
             "Rx(rx)), 2 A-B-C (R = Rz(rx) Ry(ry) Rx(rz)), 3 quaternion (x, y, z, without unit; w "
             "is never negative: 140, 22030 + 32 k; of commands 1018)",
             [](Source s) { return static_cast<double>(s.convention.orientation); }},
    MapField{4, kFloat, "test_float", "", "always 1.0: use it to check your word order",
             [](Source) { return 1.0; }},
    MapField{6, kU32, "test_u32", "", "always 0x01020304: use it to check your word order",
             [](Source) -> double { return 0x01020304; }},
    MapField{8, kU32, "firmware", "", "version of the daemon: 10000 major + 100 minor + patch",
             [](Source s) -> double { return s.environment.firmware; }},
    // 10-23 state
    MapField{10, kU16, "heartbeat", "", "increments 10 times a second, wraps after 65535",
             [](Source s) -> double { return s.environment.heartbeat; }},
    MapField{11, kU16, "status", "bits", "status word, see below",
             [](Source s) -> double { return s.snapshot.status; }},
    MapField{12, kU16, "alarms", "bits", "alarm word, see below",
             [](Source s) -> double { return s.snapshot.alarms; }},
    MapField{
        13, kU16, "first_error", "code",
        "result code of the first configured point without a correction; 0: every point has one",
        [](Source s) { return Number(s.snapshot.first_error); }},
    MapField{14, kU16, "warnings", "bits", "warning word, see below",
             [](Source s) -> double { return s.snapshot.warnings; }},
    MapField{15, kU16, "data_age", "ms",
             "age of the robot reading; 65535: older than that, or no reading yet",
             [](Source s) {
               const bool any = s.snapshot.input_fault != InputFault::kMissing;
               return any ? std::floor(1e3 * s.snapshot.data_age_s) : 65535;
             }},
    MapField{16, kU32, "uptime", "s", "time since the daemon started",
             [](Source s) { return std::floor(s.environment.uptime_s); }},
    MapField{18, kU16, "clients", "", "connected Modbus TCP clients",
             [](Source s) -> double { return s.environment.clients; }},
    MapField{19, kU16, "boot_counter", "", "number of daemon starts",
             [](Source s) -> double { return s.environment.boot_count; }},
    MapField{20, kU16, "points", "", "number of configured points, 0 to 1000",
             [](Source s) { return static_cast<double>(s.snapshot.points.size()); }},
    MapField{21, kU16, "cycle_period", "0.1 ms", "configured period of the control cycle",
             [](Source s) { return 1e4 * s.environment.cycle_period_s; }},
    MapField{22, kU16, "longest_cycle", "us",
             "longest execution time of a control cycle since the daemon started",
             [](Source s) { return 1e6 * s.environment.longest_cycle_s; }},
    MapField{23, kU16, "overruns", "",
             "control cycles that started late since the daemon started, modulo 65536",
             [](Source s) -> double { return s.environment.overruns & 0xFFFFU; }},
    MapField{24, kU16, "health", "code", "0 good, 1 notice, 2 attention, 3 alarm: do not assemble",
             [](Source s) { return static_cast<double>(s.snapshot.health.severity); }},
    MapField{25, kU16, "health_reason", "code", "the most severe reason, see below; 0: none",
             [](Source s) { return static_cast<double>(s.snapshot.health.reason); }},
};

}  // namespace

std::span<const MapField> registers::StateFields() {
  return kStateFields;
}

}  // namespace plumbline::plc
