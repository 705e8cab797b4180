// Sections of the event catalogue, in the order of `Event`.
#pragma once

#include <span>

#include "app/base/log/event.h"

namespace plumbline::log {

std::span<const EventEntry> DaemonEvents();   ///< service, robot, points, plc, loop
std::span<const EventEntry> CameraEvents();   ///< camera, monitor
std::span<const EventEntry> FleetEvents();    ///< fleet
std::span<const EventEntry> CollectEvents();  ///< collect
std::span<const EventEntry> SparkplugEvents();
std::span<const EventEntry> WorkerEvents();  ///< worker

}  // namespace plumbline::log
