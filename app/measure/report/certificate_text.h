// Texts of the certificate: limited in length, so that the page stays one page.
#pragma once

#include <cstddef>
#include <string>

namespace plumbline::measure {

inline constexpr std::size_t kMaxSentenceLength = 440;

/// The text cut at a character boundary if it is longer than the page permits.
std::string Shortened(const std::string& text, std::size_t most);

/// "1 reservation", "2 reservations".
std::string CountText(std::size_t count, const char* what);

}  // namespace plumbline::measure
