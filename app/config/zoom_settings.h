// Keys of [zoom] that the zoom sensor kinds declare.
#pragma once

#include <span>
#include <string_view>

#include "app/config/settings.h"
#include "drivers/zoom/registry.h"

namespace plumbline::config {

/// Lists the keys of all kinds, each key once.
/// @param selected_kind  name of the kind whose required keys are required; empty: none
void ListKindKeys(Settings& keys, std::span<const zoom::ZoomKind* const> kinds,
                  std::string_view selected_kind, zoom::ZoomConnection& connection);

}  // namespace plumbline::config
