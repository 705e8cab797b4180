// Format of --help: 80 columns, without lists of excluded options.
#pragma once

#include <memory>

namespace CLI {
class App;
class FormatterBase;
}  // namespace CLI

namespace plumbline::cli {

/// Wraps descriptions and footers at 80 columns. Line feeds within a paragraph of a footer do not
/// count; examples stay as they are. A long list of values moves from the
/// option's name into its description. What an option excludes or needs is left to its description
/// and to the message that refuses the combination.
std::shared_ptr<CLI::FormatterBase> HelpFormatter();

}  // namespace plumbline::cli
