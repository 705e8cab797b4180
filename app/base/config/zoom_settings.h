// Keys of [zoom] that depend on the kind of sensor; each kind declares its own.
#pragma once

#include <span>
#include <string_view>

#include "app/base/config/settings.h"
#include "drivers/zoom/registry.h"

namespace plumbline::config {

/// Lists the keys of all kinds, each key once. Only those that the configured kind needs are
/// required.
/// @param selected_kind  name of the configured kind; empty if none is configured
void ListKindKeys(Settings& keys, std::span<const zoom::ZoomKind* const> kinds,
                  std::string_view selected_kind, zoom::ZoomConnection& connection);

}  // namespace plumbline::config
