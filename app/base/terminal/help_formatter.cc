#include "app/base/terminal/help_formatter.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <sstream>
#include <string>
#include <vector>

#include "app/base/terminal/terminal_output.h"

namespace plumbline::terminal {
namespace {

constexpr std::size_t kHelpColumns = 80;
constexpr std::size_t kOptionColumn = 30;
constexpr std::size_t kCommandColumn = 23;

/// "TEXT" and "one of a, b" of "TEXT:{a,b}"; the values are empty if the type lists none.
struct TypeText {
  std::string type, values;
};

TypeText TypeTextOf(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const auto from = type.find(":{"), to = type.find('}');
  if (from == std::string::npos || to == std::string::npos) return {type, ""};
  std::string values = "one of ";
  for (const char c : type.substr(from + 2, to - from - 2)) {
    values += c == ',' ? std::string(", ") : std::string(1, c);
  }
  return {type.substr(0, from), values};
}

std::string Indented(const std::string& name, std::size_t column, const std::string& text) {
  std::ostringstream out;
  CLI::detail::format_help(out, name, text, column);
  return out.str();
}

/// Wraps paragraphs and the indented lines of tables; commands stay as they are.
std::string WrappedFooter(const std::string& footer) {
  std::istringstream lines(footer);
  std::string text, paragraph, line;
  bool in_examples = false;
  const auto end_paragraph = [&] {
    if (!paragraph.empty()) text += WrappedParagraph(paragraph, kHelpColumns, 0) + '\n';
    paragraph.clear();
  };
  while (std::getline(lines, line)) {
    if (line.empty() || line.front() == ' ') {
      end_paragraph();
      text += (in_examples ? line : WrappedLine(line, kHelpColumns)) + '\n';
    } else {
      in_examples = line.starts_with("Example");
      paragraph += (paragraph.empty() ? "" : " ") + line;
      if (line.back() == ':') end_paragraph();
    }
  }
  end_paragraph();
  return text;
}

class Formatter : public CLI::Formatter {
 public:
  std::string make_help(const CLI::App* app, std::string name,
                        CLI::AppFormatMode mode) const override {
    std::string text = CLI::Formatter::make_help(app, std::move(name), mode);
    for (std::size_t gap = 0; (gap = text.find("\n\n\n")) != std::string::npos;) text.erase(gap, 1);
    while (text.ends_with("\n\n")) text.pop_back();
    return text;
  }
  std::string make_description(const CLI::App* app) const override {
    return WrappedParagraph(app->get_description(), kHelpColumns, 0) + '\n';
  }
  std::string make_footer(const CLI::App* app) const override {
    return WrappedFooter(app->get_footer());
  }
  std::string make_subcommand(const CLI::App* sub) const override {
    return Indented(sub->get_display_name(true), kCommandColumn,
                    WrappedParagraph(sub->get_description(), kHelpColumns - kCommandColumn, 0));
  }
  std::string make_option(const CLI::Option* option, bool is_positional) const override {
    const TypeText type = TypeTextOf(*option);
    std::string name = make_option_name(option, is_positional);
    if (option->get_type_size() != 0) {
      if (!type.type.empty()) name += ' ' + type.type;
      if (!option->get_default_str().empty()) name += '=' + option->get_default_str();
      if (option->get_expected_max() == CLI::detail::expected_max_vector_size) name += " ...";
      if (option->get_required()) name += " REQUIRED";
    }
    std::string text = option->get_description();
    if (!type.values.empty()) text += (text.empty() ? "" : "; ") + type.values;
    return Indented(name, kOptionColumn, WrappedParagraph(text, kHelpColumns - kOptionColumn, 0));
  }
};

}  // namespace

std::shared_ptr<CLI::FormatterBase> HelpFormatter() {
  return std::make_shared<Formatter>();
}

}  // namespace plumbline::terminal
