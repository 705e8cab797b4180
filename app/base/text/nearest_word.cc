#include "app/base/text/nearest_word.h"

#include <algorithm>
#include <numeric>

namespace plumbline::text {
namespace {

constexpr std::size_t kMaxWordLength = 64;

/// Levenshtein distance: single-character edits from a to b.
std::size_t EditDistance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, row[j] + 1, diagonal + 1});
    }
  }
  return row.back();
}

/// The word without its unit suffix: "payload" for "payload_kg".
std::string_view WithoutUnit(std::string_view word) {
  const auto unit = word.rfind('_');
  return unit == std::string_view::npos ? word : word.substr(0, unit);
}

}  // namespace

std::string NearestWord(std::string_view word, const std::vector<std::string>& known,
                        double share) {
  std::string nearest;
  std::size_t best =
      std::max<std::size_t>(2, static_cast<std::size_t>(share * static_cast<double>(word.size()))) +
      1;
  if (word.size() > kMaxWordLength) return nearest;
  for (const std::string& candidate : known) {
    const bool is_prefix = word.size() >= 3 && candidate.compare(0, word.size(), word) == 0;
    const bool other_unit = WithoutUnit(candidate) == WithoutUnit(word);
    const std::size_t distance = is_prefix || other_unit ? 1 : EditDistance(word, candidate);
    if (distance < best && distance < candidate.size()) {
      best = distance;
      nearest = candidate;
    }
  }
  return nearest;
}

}  // namespace plumbline::text
