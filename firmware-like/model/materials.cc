#include "firmware-like/model/materials.h"

#include <algorithm>
#include <array>

namespace plumbline::model {
namespace {

constexpr std::array kMaterials{
    NamedMaterial{"aluminium", {70e9, 0.3, 2700}, "EN 1999-1-1:2007, 3.2.5"},
    NamedMaterial{"aluminium_6061", {68.3e9, 0.33, 2710}, "MIL-HDBK-5J, 3.6.2 (6061-T6)"},
    NamedMaterial{"aluminium_6082", {70e9, 0.3, 2700}, "EN 1999-1-1:2007, 3.2.5"},
    NamedMaterial{"aluminium_7075", {71.0e9, 0.33, 2800}, "MIL-HDBK-5J, 3.7.6 (7075-T6)"},
    NamedMaterial{"brass_cuzn39pb3",
                  {97e9, 0.34, 8470},
                  "Copper Development Association, alloy C38500; nu: Gere & Timoshenko, app. H"},
    NamedMaterial{"cast_iron_gjl250", {110e9, 0.26, 7200}, "EN 1561:2011, annex A (103..118 GPa)"},
    NamedMaterial{"cast_iron_gjs400", {169e9, 0.275, 7100}, "EN 1563:2011, annex (EN-GJS-400)"},
    NamedMaterial{"magnesium_az91", {45e9, 0.35, 1810}, "ASM Handbook vol. 2 (AZ91D)"},
    NamedMaterial{
        "stainless_steel", {200e9, 0.3, 7900}, "EN 1993-1-4:2006, 2.1.3; EN 10088-1 (1.4301)"},
    NamedMaterial{"steel", {210e9, 0.3, 7850}, "EN 1993-1-1:2005, 3.2.6; EN 1991-1-1, table A.4"},
    NamedMaterial{"titanium_ti6al4v", {110e9, 0.31, 4430}, "MIL-HDBK-5J, 5.4.1 (Ti-6Al-4V)"},
};

}  // namespace

std::span<const NamedMaterial> NamedMaterials() {
  return kMaterials;
}

std::optional<Material> MaterialByName(std::string_view name) {
  const auto found = std::find_if(kMaterials.begin(), kMaterials.end(),
                                  [name](const NamedMaterial& m) { return m.name == name; });
  if (found == kMaterials.end()) return std::nullopt;
  return found->material;
}

}  // namespace plumbline::model
