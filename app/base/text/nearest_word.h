// Spelling suggestion: the known word nearest to an unknown one.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace plumbline::text {

/// The nearest of `known` by edit distance; a missing or different unit suffix counts as one edit
/// ("sigma" or "sigma_m" for "sigma_mm").
/// @param share  largest edit distance as a share of the word's length; two edits are always
///               allowed
/// @return       empty if no word is near
std::string NearestWord(std::string_view word, const std::vector<std::string>& known, double share);

}  // namespace plumbline::text
