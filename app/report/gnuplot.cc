#include "app/report/gnuplot.h"

#include <chrono>
#include <regex>

#include "app/report/html.h"
#include "drivers/os/run_program.h"

namespace plumbline::report {
namespace {

// gnuplot's own escape, a doubled quote, is misread at the start of a string.
constexpr const char* kApostrophe = "\u2019";

void EraseAll(std::string& text, const std::string& pattern) {
  for (auto at = text.find(pattern); at != std::string::npos; at = text.find(pattern, at)) {
    text.erase(at, pattern.size());
  }
}

void ReplaceAll(std::string& text, const std::string& from, const std::string& to) {
  for (auto at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size())) {
    text.replace(at, from.size(), to);
  }
}

/// Removes everything from `open` to `close`, inclusive.
void EraseBetween(std::string& text, const std::string& open, const std::string& close) {
  for (auto at = text.find(open); at != std::string::npos; at = text.find(open, at)) {
    const auto end = text.find(close, at);
    if (end == std::string::npos) return;
    text.erase(at, end + close.size() - at);
  }
}

}  // namespace

Result<std::vector<std::string>> DrawSvgs(const std::string& script,
                                          const GnuplotOptions& options) {
  const std::string path = os::FindProgram(options.program);
  if (path.empty()) {
    return Error{options.program + " is not installed (Debian package gnuplot-nox)"};
  }
  // -d ignores the user's settings; the script is passed on standard input.
  const auto run = os::RunProgram({path, "-d", "-"}, script,
                                  {.time_s = std::chrono::duration<double>(options.limit).count()});
  if (!run) return Error{options.program + " " + run.error()};
  if (run->end.exit_code == os::ExitStatus::kNotRun) {
    return Error{options.program + " cannot be started"};
  }
  std::vector<std::string> documents;
  const std::string end = "</svg>";
  std::size_t at = 0;
  for (auto found = run->output.find(end); found != std::string::npos;
       found = run->output.find(end, at)) {
    documents.push_back(run->output.substr(at, found + end.size() - at));
    at = found + end.size();
  }
  if (!run->end.ok()) {
    return Error{options.program + " failed: " + run->errors.substr(0, 400)};
  }
  return documents;
}

std::string GnuplotQuoted(std::string_view text) {
  std::string quoted = "'";
  for (const char c : ValidUtf8(text)) {
    if (c == '\'') {
      quoted += kApostrophe;
    } else {
      quoted += static_cast<unsigned char>(c) < 0x20 || c == 0x7f ? ' ' : c;
    }
  }
  return quoted + '\'';
}

std::string InlineSvg(const std::string& document, const std::string& id,
                      const std::string& title) {
  const auto start = document.find("<svg");
  if (start == std::string::npos) return "";
  std::string svg = document.substr(start);
  EraseBetween(svg, "<!--", "-->");
  EraseBetween(svg, "<title>", "</title>");
  EraseBetween(svg, "<desc>", "</desc>");
  EraseBetween(svg, " font-family=\"", "\"");
  EraseAll(svg, " xmlns=\"http://www.w3.org/2000/svg\"");
  EraseAll(svg, " xmlns:xlink=\"http://www.w3.org/1999/xlink\"");
  // gnuplot uses either kind of quote.
  ReplaceAll(svg, " id=\"", " id=\"" + id + "-");
  ReplaceAll(svg, " id='", " id='" + id + "-");
  ReplaceAll(svg, "xlink:href='#", "href='#" + id + "-");
  ReplaceAll(svg, "xlink:href=\"#", "href=\"#" + id + "-");
  ReplaceAll(svg, "url(#", "url(#" + id + "-");
  const auto head = svg.find('>');
  const std::string attributes = svg.substr(4, head - 4);
  std::smatch box;
  const std::regex view_box("viewBox=\"([0-9. ]+)\"");
  const std::string kept = std::regex_search(attributes, box, view_box)
                               ? " viewBox=\"" + box[1].str() + "\""
                               : attributes;
  return "<svg role=\"img\" aria-label=\"" + Escape(title) + "\"" + kept + svg.substr(head);
}

}  // namespace plumbline::report
