#include "firmware-like/effects/catalogue.h"

#include <algorithm>
#include <array>

#include "firmware-like/effects/approach_lag.h"
#include "firmware-like/effects/backlash.h"
#include "firmware-like/effects/base_frame.h"
#include "firmware-like/effects/camera_lens.h"
#include "firmware-like/effects/camera_tag_size.h"
#include "firmware-like/effects/camera_zoom.h"
#include "firmware-like/effects/counterbalance.h"
#include "firmware-like/effects/dynamic_inertia.h"
#include "firmware-like/effects/empirical.h"
#include "firmware-like/effects/gear_periodic.h"
#include "firmware-like/effects/gear_ratio.h"
#include "firmware-like/effects/gravity_direction.h"
#include "firmware-like/effects/joint_compliance.h"
#include "firmware-like/effects/joint_hardening.h"
#include "firmware-like/effects/joint_offset.h"
#include "firmware-like/effects/latency.h"
#include "firmware-like/effects/link_geometry.h"
#include "firmware-like/effects/measurement_scale.h"
#include "firmware-like/effects/payload_cog.h"
#include "firmware-like/effects/payload_mass.h"
#include "firmware-like/effects/pedestal_compliance.h"
#include "firmware-like/effects/step_event.h"
#include "firmware-like/effects/thermal_drift.h"
#include "firmware-like/effects/thermal_growth.h"
#include "firmware-like/effects/tool_frame.h"
#include "firmware-like/effects/tool_root_compliance.h"
#include "firmware-like/effects/tool_shear.h"
#include "firmware-like/effects/tool_stiffness.h"

namespace plumbline {

std::span<const Effect* const> Catalogue() {
  static const std::array<const Effect*, 27> catalogue = {
      &BaseFrame(),           //
      &ToolFrame(),           //
      &JointOffset(),         //
      &GearRatio(),           //
      &LinkGeometry(),        //
      &JointCompliance(),     //
      &JointHardening(),      //
      &Counterbalance(),      //
      &ToolStiffness(),       //
      &ToolShear(),           //
      &ToolRootCompliance(),  //
      &PayloadMass(),         //
      &PayloadCog(),          //
      &GravityDirection(),    //
      &PedestalCompliance(),  //
      &Backlash(),            //
      &ApproachLag(),         //
      &GearPeriodic(),        //
      &ThermalGrowth(),       //
      &ThermalDrift(),        //
      &Latency(),             //
      &DynamicInertia(),      //
      &MeasurementScale(),    //
      &StepEvent(),           //
      &CameraTagSize(),       //
      &CameraZoom(),          //
      &CameraLens(),          //
  };
  return catalogue;
}

const Effect* FindEffect(std::string_view id) {
  if (id == Empirical().traits().id) return &Empirical();
  const auto catalogue = Catalogue();
  const auto found = std::find_if(catalogue.begin(), catalogue.end(),
                                  [id](const Effect* effect) { return effect->traits().id == id; });
  return found == catalogue.end() ? nullptr : *found;
}

}  // namespace plumbline
