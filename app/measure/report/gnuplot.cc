#include "app/measure/report/gnuplot.h"

#include <chrono>
#include <regex>

#include "app/measure/report/html.h"
#include "drivers/os/run_program.h"

namespace plumbline::measure {
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

/// True for gnuplot's filled point types; the others are outlines.
bool IsFilledPoint(std::string_view type) {
  for (const char* const filled : {"4", "6", "8", "10", "12", "14"}) {
    if (type == filled) return true;
  }
  return false;
}

/// Writes colours where they are used, in place of the keyword currentColor, which WeasyPrint does
/// not resolve: in lines (<g color="C" stroke="currentColor">) and points (<use href='#gpPt6'
/// color='C'/>, whose definition refers to the colour of its use).
void ResolveCurrentColor(std::string& svg) {
  const std::string line = "\" stroke=\"currentColor\"";
  for (auto at = svg.find(line); at != std::string::npos; at = svg.find(line, at)) {
    const auto start = svg.rfind(" color=\"", at);
    if (start == std::string::npos) break;
    svg.replace(at, line.size(), "\"");
    svg.replace(start, std::string_view(" color=\"").size(), " stroke=\"");
  }
  const std::string point = "<use ";
  for (auto at = svg.find(point); at != std::string::npos; at = svg.find(point, at + 1)) {
    const auto end = svg.find('>', at);
    const auto colour = svg.find(" color='", at), type = svg.find("gpPt", at);
    if (colour == std::string::npos || colour > end) continue;
    const auto close = svg.find('\'', colour + 8);
    const std::string value = svg.substr(colour + 8, close - colour - 8);
    const bool filled = type < end && IsFilledPoint(std::string_view(svg).substr(
                                          type + 4, svg.find('\'', type) - type - 4));
    svg.replace(colour, close + 1 - colour,
                (filled ? " fill='" + value + "'" : std::string()) + " stroke='" + value + "'");
  }
  EraseAll(svg, " fill='currentColor' stroke='none'");
  EraseAll(svg, " stroke='currentColor'");
  EraseAll(svg, " fill='currentColor'");
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
  ResolveCurrentColor(svg);
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

}  // namespace plumbline::measure
