#include "app/base/config/xml_document.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

namespace plumbline::config {

XmlDocument::XmlDocument(std::string_view text, const std::string& file, config::FaultList& faults)
    : text_(text) {
  line_starts_.push_back(0);
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '\n') line_starts_.push_back(static_cast<std::ptrdiff_t>(i) + 1);
  }
  const auto refuse = [&](std::ptrdiff_t offset, const std::string& what) {
    faults.Add({config::Fault::Severity::kFault, file, LineAt(offset), "", what});
  };
  const pugi::xml_parse_result result = document_.load_buffer(
      text.data(), text.size(), pugi::parse_default | pugi::parse_doctype, pugi::encoding_utf8);
  if (!result) {
    refuse(result.offset, fmt::format("is not well-formed XML: {}; correct it there or shortly "
                                      "before",
                                      result.description()));
    return;
  }
  for (const pugi::xml_node& node : document_.children()) {
    if (node.type() != pugi::node_doctype) continue;
    refuse(node.offset_debug(),
           "has a document type declaration (<!DOCTYPE ...>); entities are not expanded, so it is "
           "not accepted; remove it");
    return;
  }
  parsed_ = true;
}

int XmlDocument::LineAt(std::ptrdiff_t offset) const {
  const auto after = std::upper_bound(line_starts_.begin(), line_starts_.end(), offset);
  return static_cast<int>(after - line_starts_.begin());
}

int XmlDocument::LineOf(const pugi::xml_node& node) const {
  return LineAt(node.offset_debug());
}

std::pair<std::size_t, std::size_t> XmlDocument::StartTag(const pugi::xml_node& node) const {
  const std::size_t begin = static_cast<std::size_t>(node.offset_debug()) - 1;
  char quote = 0;
  for (std::size_t i = begin; i < text_.size(); ++i) {
    const char c = text_[i];
    if (quote != 0) {
      if (c == quote) quote = 0;
    } else if (c == '"' || c == '\'') {
      quote = c;
    } else if (c == '>') {
      return {begin, i + 1 - begin};
    }
  }
  return {begin, text_.size() - begin};
}

std::optional<std::vector<double>> NumbersFromText(std::string_view text, std::size_t count) {
  constexpr std::string_view kBlanks = " \t\r\n";
  std::vector<double> numbers;
  while (true) {
    const auto first = text.find_first_not_of(kBlanks);
    if (first == std::string_view::npos) break;
    text.remove_prefix(first);
    std::string_view word = text.substr(0, text.find_first_of(kBlanks));
    text.remove_prefix(word.size());
    if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
    double number = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
    if (error != std::errc() || end != word.data() + word.size() || !std::isfinite(number)) {
      return std::nullopt;
    }
    numbers.push_back(number);
    if (numbers.size() > count) return std::nullopt;
  }
  if (numbers.size() != count) return std::nullopt;
  return numbers;
}

}  // namespace plumbline::config
