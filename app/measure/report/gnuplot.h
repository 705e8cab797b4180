// gnuplot runner: draws a script in a child process and returns SVG documents.
#pragma once

#include <chrono>
#include <functional>
#include <string>
#include <vector>

#include "firmware-like/result.h"

namespace plumbline::measure {

/// The program is searched for on PATH and started without a shell.
struct GnuplotOptions {
  std::string program = "gnuplot";
  std::chrono::milliseconds limit{60000};  ///< time limit
};

/// Runs one script whose plots go to gnuplot's standard output as SVG.
/// @return  the SVG documents in the order of the plots, or why there are none, with a remedy
Result<std::vector<std::string>> DrawSvgs(const std::string& script,
                                          const GnuplotOptions& options = {});

/// A text as single-quoted gnuplot string, in which nothing is expanded; control characters become
/// blanks, quotes become apostrophes.
std::string GnuplotQuoted(std::string_view text);

/// Prepares an SVG document of gnuplot for embedding in HTML: without prologue, namespaces and
/// fonts, with ids prefixed by `id`, and scaling with the page.
/// @param title  description for screen readers
std::string InlineSvg(const std::string& document, const std::string& id, const std::string& title);

}  // namespace plumbline::measure
