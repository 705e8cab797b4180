#include "app/measure/report/html.h"

#include <algorithm>
#include <optional>

namespace plumbline::measure {
namespace {

constexpr std::size_t kShortTable = 16;  // rows that are kept on one page
constexpr std::size_t kShortPart = 8;    // the same for tables beside each other

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

constexpr std::string_view kDigits = "0123456789", kPlusMinus = " &plusmn; ";
constexpr const char *kFigureSpace = "\u2007", *kPointSpace = "\u2008";  // as wide as 0 and as .

/// Digits before and after the decimal point of a number.
struct Places {
  std::size_t whole = 0, decimals = 0;
};

/// Nothing if the HTML is not a plain number, such as one with a power of ten.
std::optional<Places> PlacesOf(std::string_view html) {
  const std::size_t first = std::min(html.find_first_of(kDigits), html.size());
  const std::string_view sign = html.substr(0, first), number = html.substr(first);
  const bool plain = sign.empty() || sign == "&minus;" || sign == "&lt;" || sign == "&gt; ";
  if (number.empty() || !plain || number.find_first_not_of("0123456789.") != number.npos) return {};
  const std::size_t point = std::min(number.find('.'), number.size());
  return Places{point, point == number.size() ? 0 : number.size() - point - 1};
}

std::string Repeated(const char* space, std::size_t count) {
  std::string spaces;
  for (std::size_t k = 0; k < count; ++k) spaces += space;
  return spaces;
}

/// Adds spaces that put the decimal points of right-aligned numbers below each other.
/// @param equal_width  also make all numbers as wide as the longest one
void AlignAtPoint(std::vector<std::string>& numbers, bool equal_width) {
  Places most;
  for (const std::string& number : numbers) {
    const Places places = PlacesOf(number).value_or(Places{});
    most = {std::max(most.whole, places.whole), std::max(most.decimals, places.decimals)};
  }
  for (std::string& number : numbers) {
    const std::optional<Places> places = PlacesOf(number);
    if (!places) continue;
    number = Repeated(kFigureSpace, equal_width ? most.whole - places->whole : 0) + number +
             Repeated(kPointSpace, places->decimals == 0 && most.decimals > 0 ? 1 : 0) +
             Repeated(kFigureSpace, most.decimals - places->decimals);
  }
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

std::string ListHtml(const std::vector<std::string>& items) {
  if (items.empty()) return "";
  std::string html = "<ul>\n";
  for (const std::string& item : items) html += "<li>" + Escape(item) + "</li>\n";
  return html + "</ul>\n";
}

HtmlTable::HtmlTable(std::vector<std::string> headers, std::vector<std::size_t> text_columns)
    : headers_(std::move(headers)), text_columns_(std::move(text_columns)) {}

bool HtmlTable::IsText(std::size_t column) const {
  return std::ranges::find(text_columns_, column) != text_columns_.end();
}

void HtmlTable::AddRow(const std::vector<std::string>& cells, bool strong) {
  rows_.push_back({cells, strong, false});
}

void HtmlTable::AddNote(const std::string& cell, const std::string& note) {
  rows_.push_back({{cell, note}, false, true});
}

/// The cells of a column of numbers, values and uncertainties each aligned at the decimal point.
std::vector<std::string> HtmlTable::AlignedColumn(std::size_t column) const {
  std::vector<std::string> values, uncertainties;
  for (const Row& row : rows_) {
    const std::string cell = row.note || column >= row.cells.size() ? "" : row.cells[column];
    const std::size_t end = std::min(cell.find(kPlusMinus), cell.size());
    values.push_back(cell.substr(0, end));
    uncertainties.push_back(end == cell.size() ? "" : cell.substr(end + kPlusMinus.size()));
  }
  AlignAtPoint(values, false);
  AlignAtPoint(uncertainties, true);
  for (std::size_t k = 0; k < values.size(); ++k) {
    if (!uncertainties[k].empty()) values[k] += std::string(kPlusMinus) + uncertainties[k];
  }
  return values;
}

std::string HtmlTable::Html() const {
  return rows_.size() <= kShortTable
             ? "<div class=\"table whole\">" + PartHtml(0, rows_.size()) + "</div>\n"
             : "<div class=\"table\">" + PartHtml(0, rows_.size()) + "</div>\n";
}

std::string HtmlTable::HtmlAcross(std::size_t parts) const {
  std::string html;
  for (std::size_t r = 0; r < rows_.size();) {
    const std::size_t rows = std::min(kShortPart, (rows_.size() - r + parts - 1) / parts);
    html += "<div class=\"panels across" + std::to_string(parts) + "\">\n";
    for (std::size_t part = 0; part < parts && r < rows_.size(); ++part, r += rows) {
      html += "<div class=\"panel table\">" + PartHtml(r, std::min(rows_.size(), r + rows)) +
              "</div>\n";
    }
    html += "</div>\n";
  }
  return html;
}

/// A table of the rows from `first` to before `end`.
std::string HtmlTable::PartHtml(std::size_t first, std::size_t end) const {
  const auto style = [this](std::size_t k) { return IsText(k) ? "" : " class=\"number\""; };
  std::string html = "<table>\n<thead><tr>";
  std::vector<std::vector<std::string>> columns;
  for (std::size_t k = 0; k < headers_.size(); ++k) {
    std::string header = headers_[k];
    if (const auto unit = header.find(" ("); unit != std::string::npos)
      header.replace(unit, 1, "&nbsp;");  // the unit stays with the last word
    html += std::string("<th scope=\"col\"") + style(k) + ">" + header + "</th>";
    columns.push_back(IsText(k) ? std::vector<std::string>() : AlignedColumn(k));
  }
  html += "</tr></thead>\n<tbody>\n";
  for (std::size_t r = first; r < end; ++r) {
    const Row& row = rows_[r];
    html += row.strong ? "<tr class=\"strong\">" : "<tr>";
    if (row.note) {
      html += "<td>" + row.cells[0] + "</td><td class=\"number\" colspan=\"" +
              std::to_string(headers_.size() - 1) + "\">" + row.cells[1] + "</td>";
    }
    for (std::size_t k = 0; k < row.cells.size() && !row.note; ++k)
      html += std::string("<td") + style(k) + ">" + (IsText(k) ? row.cells[k] : columns[k][r]) +
              "</td>";
    html += "</tr>\n";
  }
  return html + "</tbody></table>";
}

}  // namespace plumbline::measure
