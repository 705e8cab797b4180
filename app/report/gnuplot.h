// gnuplot as a child process: a script in, pictures out.
#pragma once

#include <chrono>
#include <functional>
#include <string>
#include <vector>

#include "firmware-like/result.h"

namespace plumbline {

/// How a picture is drawn. The program is looked for on PATH and started without a shell.
struct GnuplotOptions {
  std::string program = "gnuplot";
  std::chrono::milliseconds limit{60000};
};

/// Runs one script whose plots go to gnuplot's standard output as SVG.
/// @return  the SVG documents in their order, or why there are none, with what to do about it
Result<std::vector<std::string>> DrawSvgs(const std::string& script,
                                          const GnuplotOptions& options = {});

/// A text as gnuplot's single-quoted string, in which nothing is expanded; control characters
/// become blanks, quotes apostrophes.
std::string GnuplotQuoted(std::string_view text);

/// An SVG document of gnuplot as a part of an HTML page: without prologue, namespaces and fonts of
/// its own, its ids made unique by `id`, scaling with the page.
/// @param title  what a screen reader says of it
std::string InlineSvg(const std::string& document, const std::string& id, const std::string& title);

}  // namespace plumbline
