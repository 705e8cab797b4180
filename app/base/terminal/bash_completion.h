// Completion script for bash, generated from a program's parser.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace plumbline::terminal {

/// A function for `complete -F` that offers commands, options and enumerated option values of
/// `program`. It is called `_program`, with `_` for `-`.
std::string BashCompletion(const CLI::App& app, const std::string& program);

}  // namespace plumbline::terminal
