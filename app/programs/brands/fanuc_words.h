// Words of FANUC TP programs, in the languages of the pendant.
#pragma once

#include <string_view>

namespace plumbline::programs::fanuc {

/// The English word for a word of a program in German ("WKZ_NUM" is "UTOOL_NUM"); any other word
/// itself. The German ones are those found in programs of real controllers.
std::string_view EnglishWord(std::string_view word);

}  // namespace plumbline::programs::fanuc
