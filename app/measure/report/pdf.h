// PDF of a report, printed by WeasyPrint.
#pragma once

#include <chrono>
#include <string>

#include "firmware-like/result.h"

namespace plumbline::measure {

/// The program is searched for on PATH and started without a shell.
struct PdfOptions {
  std::string program = "weasyprint";
  std::chrono::milliseconds limit{300000};  ///< time limit
};

/// Why no PDF can be printed, with a remedy; empty if the program is installed.
std::string WhyNoPdf(const PdfOptions& options = {});

/// Prints a self-contained HTML document with its print style.
/// @return  the bytes of the PDF, or why there are none
Result<std::string> PdfFromHtml(const std::string& html, const PdfOptions& options = {});

}  // namespace plumbline::measure
