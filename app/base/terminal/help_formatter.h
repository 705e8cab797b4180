// Format of --help: 80 columns, without lists of excluded options.
#pragma once

#include <memory>

namespace CLI {
class App;
class FormatterBase;
}  // namespace CLI

namespace plumbline::terminal {

/// Wraps descriptions and footers at 80 columns. Line feeds within a paragraph of a footer are
/// treated as spaces; examples are left unchanged. A long list of values moves from the option's
/// name into its description. The options that an option excludes or needs are not listed; its
/// description and the error message for an invalid combination name them.
std::shared_ptr<CLI::FormatterBase> HelpFormatter();

}  // namespace plumbline::terminal
