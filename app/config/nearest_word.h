// The known word that somebody most likely meant.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace plumbline {

/// The nearest of `known` by single-character edits, a forgotten or another unit counting as one
/// ("sigma" or "sigma_m" for "sigma_mm"); empty where none is near.
/// @param share  how much of the word may be wrong, at least two characters
std::string NearestWord(std::string_view word, const std::vector<std::string>& known, double share);

}  // namespace plumbline
