// Steps of the routines of a URScript file.
#pragma once

#include <map>
#include <set>
#include <string>
#include <string_view>

#include "app/programs/brands/urscript_syntax.h"
#include "app/programs/program.h"

namespace plumbline::programs::urscript {

/// Routines that can be called from any file, by name: those at the outermost level of the one file
/// that has the name. Their names are their labels.
using Callable = std::map<std::string, std::size_t, std::less<>>;

/// Names that other files call.
using Called = std::set<std::string, std::less<>>;

/// Key of the base in which poses stand that are in no feature.
inline constexpr char kRobotBase[] = "robot base";

/// Adds points, routines, tools, features and loads of a file to the program. Two passes: the first
/// finds the poses to which motions go as they are written.
/// @param file_prefix  makes labels and names of the file unique; empty for a single file
void AddRoutines(const Syntax& syntax, std::size_t file, const Callable& callable,
                 const Called& called_elsewhere, const std::string& file_prefix, Program& program);

}  // namespace plumbline::programs::urscript
