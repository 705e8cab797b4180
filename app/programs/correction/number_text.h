// Texts of numbers that replace others in a program.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "app/programs/brand.h"

namespace plumbline::programs {

/// Bytes [begin, end) of a file, and what replaces them.
struct Edit {
  std::size_t file = 0;
  std::size_t begin = 0, end = 0;
  std::string text;
};

/// A value as it is written in place of an old number: with its decimals and at least those of the
/// style, its sign, leading zero and exponent, or in the fixed form of the style. The old text
/// itself if the difference vanishes at its digits.
/// @param turn      an angle's whole turn, or 0: a value that is the old one plus whole turns at
/// its
///                  digits keeps the old text, and of an old value within half a turn the new one,
///                  rounded, is within it, too
/// @param old_text  as in the file
/// @return          nullopt if the old text is not a number of that value, or the new one is not
///                  finite or cannot be written
std::optional<std::string> FormattedLike(std::string_view old_text, double old_value, double value,
                                         const NumberStyle& style, double turn = 0);

/// The edit that replaces a number. A fixed style keeps the right end of the number: a longer text
/// takes blanks before it, and a shorter one adds some.
/// @param bytes  of the number's file
/// @return       nullopt as FormattedLike()
std::optional<Edit> NumberEdit(std::string_view bytes, const Number& number, double value,
                               const NumberStyle& style, double turn = 0);

/// The value of a number's text, with a sign, without leading zero, or with an exponent.
std::optional<double> NumberFromText(std::string_view text);

}  // namespace plumbline::programs
