// Completion script for bash, generated from a program's parser.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace plumbline::terminal {

/// A script that completes commands, options and enumerated option values of `program`; everything
/// else is completed as a file name. Its function is `_program`, with `_` for `-`.
std::string BashCompletion(const CLI::App& app, const std::string& program);

}  // namespace plumbline::terminal
