#include "app/base/target/tag_family.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "app/base/target/tag_codes.inc"

namespace plumbline::target {
namespace {

// Upper bound on the probability that a square of random cells is taken for a tag of the family;
// limits the number of corrected bits.
constexpr double kMaxFalseTags = 3e-5;

/// Probability that a square of random cells is a code in one of four orientations.
double FalseTagsWithoutCorrection(std::size_t codes, int bits) {
  return 4 * static_cast<double>(codes) / std::exp2(bits);
}

/// The largest h <= most with 4 N sum_{k <= h} C(n, k) / 2^n below kMaxFalseTags; 0 at least.
int CorrectableBits(std::size_t codes, int bits, int most) {
  double ways = 1, sum = 1;
  int correctable = 0;
  for (int k = 1; k <= most; ++k) {
    ways *= static_cast<double>(bits - k + 1) / k;
    sum += ways;
    if (FalseTagsWithoutCorrection(codes, bits) * sum > kMaxFalseTags) break;
    correctable = k;
  }
  return correctable;
}

}  // namespace

std::uint64_t RotatedClockwise(std::uint64_t code, int n) {
  std::uint64_t turned = 0;
  for (int r = 0; r < n; ++r) {
    for (int c = 0; c < n; ++c) {
      const int from = (n - 1 - c) * n + r;  // row n-1-c, column r
      turned = (turned << 1) | ((code >> (n * n - 1 - from)) & 1);
    }
  }
  return turned;
}

Result<TagFamily> TagFamilyOfName(std::string_view name) {
  const auto* const named =
      std::find_if(std::begin(tag_codes::kDictionaries), std::end(tag_codes::kDictionaries),
                   [&](const auto& d) { return d.name == name; });
  if (named == std::end(tag_codes::kDictionaries)) {
    return Error{
        fmt::format("\"{}\" is not a tag family; choose one of {}", name, TagFamilyNames())};
  }
  TagFamily family;
  family.name = name;
  family.data_cells = named->data_cells;
  family.codes.assign(named->codes.begin(), named->codes.end());
  const int bits = family.data_cells * family.data_cells;
  family.correctable_bits =
      CorrectableBits(family.codes.size(), bits, named->most_correctable_bits);
  family.strict = FalseTagsWithoutCorrection(family.codes.size(), bits) > kMaxFalseTags;
  return family;
}

bool OpenCvTurns(const TagFamily& family) {
  return !family.name.starts_with("aruco");
}

std::string TagFamilyNames() {
  std::string names;
  for (const auto& named : tag_codes::kDictionaries) {
    if (!names.empty()) names += ", ";
    names += named.name;
  }
  return names;
}

std::optional<TagCode> NearestTag(const TagFamily& family, std::uint64_t read,
                                  int most_wrong_bits) {
  TagCode best{0, most_wrong_bits + 1, 0};
  // A tag rotated clockwise by k quarter turns is upright after 4 - k more.
  for (int turns = 4; turns >= 1; --turns) {
    for (std::size_t id = 0; id < family.codes.size(); ++id) {
      const int wrong = std::popcount(family.codes[id] ^ read);
      if (wrong < best.wrong_bits) best = {static_cast<int>(id), wrong, turns % 4};
    }
    read = RotatedClockwise(read, family.data_cells);
  }
  if (best.wrong_bits > most_wrong_bits) return std::nullopt;
  return best;
}

}  // namespace plumbline::target
