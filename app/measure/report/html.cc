#include "app/measure/report/html.h"

#include <algorithm>

namespace plumbline::measure {
namespace {

constexpr int kShortTable = 16;  // rows that are kept on one page

/// Length of the UTF-8 sequence at the start of the text; 0 if invalid.
std::size_t SequenceLength(std::string_view text) {
  const auto byte = [text](std::size_t k) { return static_cast<unsigned char>(text[k]); };
  const unsigned char first = byte(0);
  if (first < 0x80) return 1;
  const std::size_t length = first >= 0xF0 ? 4 : first >= 0xE0 ? 3 : 2;
  if (first < 0xC2 || first > 0xF4 || text.size() < length) return 0;
  for (std::size_t k = 1; k < length; ++k) {
    if ((byte(k) & 0xC0) != 0x80) return 0;
  }
  const bool overlong = (first == 0xE0 && byte(1) < 0xA0) || (first == 0xF0 && byte(1) < 0x90);
  const bool beyond = (first == 0xED && byte(1) > 0x9F) || (first == 0xF4 && byte(1) > 0x8F);
  return overlong || beyond ? 0 : length;
}

}  // namespace

std::string ValidUtf8(std::string_view text) {
  std::string valid;
  while (!text.empty()) {
    const std::size_t length = SequenceLength(text);
    valid += length == 0 ? std::string_view("\xEF\xBF\xBD") : text.substr(0, length);
    text.remove_prefix(std::max<std::size_t>(length, 1));
  }
  return valid;
}

std::string Escape(std::string_view text) {
  std::string escaped;
  for (const char c : ValidUtf8(text)) {
    switch (c) {
      case '&':
        escaped += "&amp;";
        break;
      case '<':
        escaped += "&lt;";
        break;
      case '>':
        escaped += "&gt;";
        break;
      case '"':
        escaped += "&quot;";
        break;
      case '\'':
        escaped += "&#39;";
        break;
      default:
        escaped += static_cast<unsigned char>(c) < 0x20 && c != '\n' && c != '\t' ? ' ' : c;
    }
  }
  return escaped;
}

std::string NumberHtml(const std::string& number) {
  std::string text = number;
  const auto e = text.find('e');
  const bool scientific = e != std::string::npos && e > 0 && e + 1 < text.size() &&
                          (text[e + 1] == '-' || text[e + 1] == '+');
  std::string power;
  if (scientific) {
    power = text.substr(e + 1);
    text.resize(e);
    const bool negative = power[0] == '-';
    power.erase(0, std::min(power.find_first_not_of("+-0"), power.size() - 1));
    power = "&thinsp;&times;&thinsp;10<sup>" + std::string(negative ? "&minus;" : "") + power +
            "</sup>";
  }
  const bool minus = text.starts_with('-');
  return (minus ? "&minus;" + Escape(text.substr(1)) : Escape(text)) + power;
}

HtmlTable::HtmlTable(std::vector<std::string> headers, std::vector<std::size_t> text_columns)
    : headers_(std::move(headers)), text_columns_(std::move(text_columns)) {}

std::string HtmlTable::Class(std::size_t column) const {
  const bool text = std::ranges::find(text_columns_, column) != text_columns_.end();
  return text ? "" : " class=\"number\"";
}

void HtmlTable::AddRow(const std::vector<std::string>& cells, bool strong) {
  rows_ += strong ? "<tr class=\"strong\">" : "<tr>";
  for (std::size_t k = 0; k < cells.size(); ++k)
    rows_ += "<td" + Class(k) + ">" + cells[k] + "</td>";
  rows_ += "</tr>\n";
  ++count_;
}

void HtmlTable::AddNote(const std::string& cell, const std::string& note) {
  rows_ += "<tr><td>" + cell + "</td><td class=\"number\" colspan=\"" +
           std::to_string(headers_.size() - 1) + "\">" + note + "</td></tr>\n";
  ++count_;
}

std::string HtmlTable::Html() const {
  std::string html =
      count_ <= kShortTable ? "<div class=\"table whole\">" : "<div class=\"table\">";
  html += "<table>\n<thead><tr>";
  for (std::size_t k = 0; k < headers_.size(); ++k) {
    html += "<th scope=\"col\"" + Class(k) + ">" + headers_[k] + "</th>";
  }
  return html + "</tr></thead>\n<tbody>\n" + rows_ + "</tbody></table></div>\n";
}

}  // namespace plumbline::measure
