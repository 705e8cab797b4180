// The scalars of a YAML text with their paths and lines.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "firmware-like/result.h"

namespace plumbline::text {

/// One scalar: `kinematics.shoulder.x`; elements of lists are numbered from 1 (`poses[2].x`).
struct YamlScalar {
  std::string path;
  std::string value;
  int line = 0;  ///< from 1
};

/// Largest number of scalars, bytes of their values and paths together, and depth of a text.
/// Aliases are followed, so these also bound what a few lines of nested aliases may expand to.
inline constexpr std::size_t kMaxYamlScalars = 200000;
inline constexpr std::size_t kMaxYamlBytes = 64U << 20U;
inline constexpr int kMaxYamlDepth = 16;

/// Every scalar of the first document, in the order of the text. Nulls are left out.
/// @return  the scalars, or the reason with its line ("line 3: ...")
Result<std::vector<YamlScalar>> ScalarsFromYaml(std::string_view text);

}  // namespace plumbline::text
