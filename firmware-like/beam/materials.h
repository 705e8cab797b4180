// The materials known by name.
#pragma once

#include <span>
#include <string_view>

#include "firmware-like/model/section.h"

namespace plumbline {

struct NamedMaterial {
  std::string_view name;
  Material material;
  std::string_view source;
};

/// All of them, in alphabetical order. Values are typical ones at 20 degrees C; where the tool's
/// own certificate says otherwise, its values go into the configuration instead.
std::span<const NamedMaterial> NamedMaterials();

}  // namespace plumbline
