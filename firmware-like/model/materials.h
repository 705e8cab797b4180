// Table of materials that a configuration can name.
#pragma once

#include <span>
#include <string_view>

#include "firmware-like/model/section.h"

namespace plumbline::model {

struct NamedMaterial {
  std::string_view name;
  Material material;
  std::string_view source;
};

/// All named materials in alphabetical order, with typical values at 20 degrees C. If the tool's
/// material certificate states other values, enter those in the configuration instead.
std::span<const NamedMaterial> NamedMaterials();

}  // namespace plumbline::model
