#include "app/measure/report/pdf.h"

#include "drivers/os/run_program.h"

namespace plumbline::measure {

std::string WhyNoPdf(const PdfOptions& options) {
  if (!os::FindProgram(options.program).empty()) return "";
  return options.program +
         " is not installed (Debian package weasyprint); install it, or write the report with "
         "--report and print it from a browser";
}

Result<std::string> PdfFromHtml(const std::string& html, const PdfOptions& options) {
  if (const std::string why = WhyNoPdf(options); !why.empty()) return Error{why};
  const auto run = os::RunProgram({os::FindProgram(options.program), "--quiet", "-", "-"}, html,
                                  {.time_s = std::chrono::duration<double>(options.limit).count()});
  if (!run) return Error{options.program + " " + run.error()};
  if (run->end.exit_code == os::ExitStatus::kNotRun) {
    return Error{options.program + " cannot be started"};
  }
  if (!run->end.ok() || !run->output.starts_with("%PDF-")) {
    return Error{options.program + " failed: " + run->errors.substr(0, 400)};
  }
  return run->output;
}

}  // namespace plumbline::measure
