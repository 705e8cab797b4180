// Registers 400-427: probes, drift monitor, model in force, clients that write commands.
#include <array>

#include "drivers/plc/register_values.h"

namespace plumbline::plc {
namespace {

using enum FieldType;

template <int K>
double ProbeResidual(Source s) {
  return kMmPerMetre * s.environment.monitoring.residual_m[K];
}
template <int K>
double ProbeResidualScaled(Source s) {
  return 1e5 * s.environment.monitoring.residual_m[K];
}

const std::array kMonitoringFields = {
    // 400-427 probes, drift monitor, model, masters
    MapField{
        400, kU16, "loop_state", "bits",
        "state of the monitoring: bit 0 probes are recorded, 1 drift alarm, 2 a proposed "
        "model awaits approval, 3 the drift reference is being collected, 4 diagnosis "
        "running, 5 journal or diagnosis failed, 6 probes in quarantine, 7 drift reference "
        "rejected: its probes disagree, 8 state directory cannot be written, 9 the drift reference "
        "contradicts the stated radius",
        [](Source s) -> double { return registers::MonitoringWord(s.environment.monitoring); }},
    MapField{401, kU16, "model_applied", "", "version of the cell model in force",
             [](Source s) -> double { return s.environment.monitoring.model.applied; }},
    MapField{402, kU16, "model_proposed", "", "version of the model that awaits approval; 0: none",
             [](Source s) -> double { return s.environment.monitoring.model.proposed; }},
    MapField{403, kU16, "model_declared", "", "version of the model declared in the cell file",
             [](Source s) -> double { return s.environment.monitoring.model.declared; }},
    MapField{404, kU32, "probes", "", "probes written to the journal since the daemon started",
             [](Source s) -> double { return s.environment.monitoring.probes; }},
    MapField{406, kFloat, "drift_statistic", "",
             "statistic of the drift monitor; it alarms above 1",
             [](Source s) { return s.environment.monitoring.drift_statistic; }},
    MapField{408, kFloat, "residual_x", "mm",
             "residual of the last probe: measured minus predicted tip, measurement frame",
             ProbeResidual<0>},
    MapField{410, kFloat, "residual_y", "mm", "", ProbeResidual<1>},
    MapField{412, kFloat, "residual_z", "mm", "", ProbeResidual<2>},
    MapField{414, kU16, "drift_statistic_scaled", "0.01", "as register 406; saturates at 655.35",
             [](Source s) { return 100 * s.environment.monitoring.drift_statistic; }},
    MapField{415, kI16, "residual_x_scaled", "0.01 mm",
             "as registers 408-413; saturates at -327.68 and 327.67 mm", ProbeResidualScaled<0>},
    MapField{416, kI16, "residual_y_scaled", "0.01 mm", "", ProbeResidualScaled<1>},
    MapField{417, kI16, "residual_z_scaled", "0.01 mm", "", ProbeResidualScaled<2>},
    MapField{418, kU16, "model_fitted", "",
             "1: the model in force was fitted to measured points; 0: it is the declared model and "
             "its uncertainty is assumed",
             [](Source s) -> double { return s.environment.monitoring.model.fitted ? 1 : 0; }},
    MapField{419, kU16, "model_effects", "", "number of effects in the model in force",
             [](Source s) -> double { return s.environment.monitoring.model.effects; }},
    MapField{
        420, kU32, "probes_refused", "",
        "probes rejected since the daemon started: implausible, or taken while the robot moved",
        [](Source s) -> double { return s.snapshot.probes.refused; }},
    MapField{422, kU16, "probes_quarantined", "",
             "probes in quarantine: in the journal, but not used until a person accepts them",
             [](Source s) -> double { return s.environment.monitoring.quarantined; }},
    MapField{423, kU16, "probe_fault", "",
             "fault of the newest probe: 0 none, 1 all zero, 2 given in metres, 3 beyond the arm's "
             "reach, 4 the robot moved",
             [](Source s) { return static_cast<double>(s.snapshot.probes.fault); }},
    MapField{424, kU16, "robot_standstill", "",
             "1: the robot state is trusted and the robot is at standstill; required for a probe",
             [](Source s) -> double { return s.snapshot.probes.standstill ? 1 : 0; }},
    MapField{425, kU16, "master_address", "",
             "last two bytes of the IPv4 address of the client whose command was executed last "
             "(third byte high, fourth byte low); 0: none, or the serial line",
             [](Source s) -> double { return s.environment.masters.executed; }},
    MapField{426, kU16, "master_port", "", "TCP port of that client; 0: none, or the serial line",
             [](Source s) -> double { return s.environment.masters.executed_port; }},
    MapField{427, kU16, "other_master", "",
             "as 425, for the other client that writes commands, while warning bit 15 is set; "
             "otherwise 0",
             [](Source s) -> double { return s.environment.masters.other; }},
};

}  // namespace

std::span<const MapField> registers::MonitoringFields() {
  return kMonitoringFields;
}

}  // namespace plumbline::plc
