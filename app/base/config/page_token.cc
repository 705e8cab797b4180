#include "app/base/config/page_token.h"

#include <sys/random.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <string_view>
#include <vector>

namespace plumbline::config {
namespace {

constexpr std::size_t kDigits = 32;
constexpr double kMinBits = 86;

/// Entropy of the values' frequencies [bits per value]; values are 0..15.
double EntropyOf(const std::vector<unsigned>& values) {
  std::array<int, 16> counts{};
  for (const unsigned value : values) ++counts[value];
  double bits = 0;
  for (const int count : counts) {
    const double share = static_cast<double>(count) / static_cast<double>(values.size());
    if (count > 0) bits -= share * std::log2(share);
  }
  return bits;
}

double EstimatedBits(const std::vector<unsigned>& digits) {
  double least = EntropyOf(digits);
  for (const std::size_t apart : {1U, 2U}) {
    std::vector<unsigned> differences;
    for (std::size_t k = apart; k < digits.size(); ++k) {
      differences.push_back((digits[k] - digits[k - apart]) % 16U);
    }
    least = std::min(least, EntropyOf(differences));
  }
  return static_cast<double>(digits.size()) * least;
}

/// True if the digits consist of one sequence repeated at least twice.
bool IsPeriodic(const std::vector<unsigned>& digits) {
  for (std::size_t period = 1; 2 * period <= digits.size(); ++period) {
    const auto shifted = digits.begin() + static_cast<std::ptrdiff_t>(period);
    if (std::equal(shifted, digits.end(), digits.begin())) return true;
  }
  return false;
}

}  // namespace

std::string GeneratedToken() {
  constexpr std::string_view kHex = "0123456789abcdef";
  std::array<unsigned char, kDigits / 2> bytes{};
  while (getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) {
  }
  std::string token;
  for (const unsigned char byte : bytes) {
    token += kHex[byte >> 4U];
    token += kHex[byte & 15U];
  }
  return token;
}

std::optional<std::string> WhyTokenWeak(const std::string& token) {
  constexpr const char* kRemedy = "; `plumbline token` prints a random one";
  std::vector<unsigned> digits;
  for (const char c : token) {
    const auto digit = static_cast<unsigned char>(c);
    if (std::isxdigit(digit) == 0) break;
    digits.push_back(std::isdigit(digit) != 0 ? digit - '0' : std::tolower(digit) - 'a' + 10U);
  }
  if (digits.size() != token.size() || digits.size() < kDigits) {
    return std::string("its token is not 32 or more hexadecimal digits, so it may be guessed") +
           kRemedy;
  }
  if (EstimatedBits(digits) >= kMinBits && !IsPeriodic(digits)) return std::nullopt;
  return std::string("its token is a pattern, not random") + kRemedy;
}

}  // namespace plumbline::config
