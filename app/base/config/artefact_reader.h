// Reader of a cell's artefacts and of the known distances between them.
#pragma once

#include <vector>

#include "app/base/config/toml_reader.h"
#include "firmware-like/model/artefact.h"

namespace plumbline::config {

/// The `[[artefact]]` tables, in order. Faults: a name twice, a key that does not belong to the
/// kind, a normal or direction of zero length.
std::vector<model::Artefact> ArtefactsFromToml(const TomlTable& root);

/// The `[[distance]]` tables, in order. Faults: an unknown name, the same artefact twice, an
/// artefact that is no point, artefacts of different frames.
std::vector<model::KnownDistance> DistancesFromToml(const TomlTable& root,
                                                    const std::vector<model::Artefact>& artefacts);

}  // namespace plumbline::config
