// Tokens of the page: how they are made, and which are accepted.
#pragma once

#include <optional>
#include <string>

namespace plumbline::config {

/// 128 random bits of the kernel, as 32 hexadecimal digits.
std::string GeneratedToken();

/// Why a token can be guessed, and how to make a better one; nullopt for a strong token. Strong
/// means at least 32 hexadecimal digits whose estimated information is at least 86 bits: their
/// number times the entropy of the digits, or of the differences between digits one or two places
/// apart, whichever is least. Words and dates cannot be written in hexadecimal digits, repeats and
/// sequences have little entropy. An estimate from so few digits is low: 115 bits for a typical
/// generated token, below 88 for one in 100,000. The text never contains the token.
std::optional<std::string> WhyTokenWeak(const std::string& token);

}  // namespace plumbline::config
