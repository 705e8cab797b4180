#include "app/base/config/toml_reader.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <sstream>

namespace plumbline::config {
namespace {

constexpr std::size_t kMaxQuotedValue = 60;  // characters of a value that a fault quotes

int LineOfNode(const toml::node& node) {
  return static_cast<int>(node.source().begin.line);
}

/// The value as quoted in a fault: on one line, printable, of limited length.
std::string ValueText(const toml::node& node) {
  if (const auto* number = node.as_floating_point()) return fmt::format("{}", number->get());
  if (node.is_table()) return "a table";
  if (const auto* array = node.as_array()) {
    std::string text = "[";
    for (const toml::node& element : *array) {
      if (text.size() > 1) text += ", ";
      if (text.size() > kMaxQuotedValue) return text + "...]";
      text += ValueText(element);
    }
    return text + "]";
  }
  std::string text;
  if (const auto* string = node.as_string()) {
    text = string->get().substr(0, kMaxQuotedValue);
    while (!text.empty() && text.size() < string->get().size() && (text.back() & 0x80) != 0) {
      text.pop_back();  // do not cut inside a UTF-8 sequence
    }
    for (char& c : text) {
      if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F) c = '?';
    }
    return fmt::format("\"{}{}\"", text, text.size() < string->get().size() ? "..." : "");
  }
  std::ostringstream stream;
  node.visit([&stream](const auto& value) { stream << value; });
  return stream.str();
}

std::string OutsideText(double min, double max) {
  const NumberRange range{min, max};
  return std::isinf(max) ? "is not " + RangeText(range) : "is outside " + RangeText(range);
}

}  // namespace

std::string RangeText(NumberRange range) {
  if (std::isinf(range.max)) return fmt::format("{} or more", range.min);
  return fmt::format("{}..{}", range.min, range.max);
}

TomlTable::TomlTable(TomlDocument& document, const toml::table& table, std::string path)
    : document_(&document), table_(&table), path_(std::move(path)) {
  document_->known_keys_[table_].path = path_;
}

bool IsEmptyTable(const toml::node& node) {
  if (const auto* table = node.as_table()) {
    return std::all_of(table->begin(), table->end(),
                       [](const auto& entry) { return IsEmptyTable(entry.second); });
  }
  const auto* array = node.as_array();
  return array != nullptr && !array->empty() &&
         std::all_of(array->begin(), array->end(), IsEmptyTable);
}

bool TomlTable::Has(std::string_view key) const {
  const toml::node* node = table_->get(key);
  return node != nullptr && !IsEmptyTable(*node);
}

int TomlTable::Line() const {
  return std::max(1, LineOfNode(*table_));
}

std::string TomlTable::Text() const {
  std::ostringstream text;
  text << *table_;
  return text.str();
}

int TomlTable::LineOf(std::string_view key) const {
  const toml::node* node = table_->get(key);
  return node != nullptr ? LineOfNode(*node) : Line();
}

std::string TomlTable::PathOf(std::string_view key) const {
  if (path_.empty()) return std::string(key);
  return key.empty() ? path_ : fmt::format("{}.{}", path_, key);
}

const toml::node* TomlTable::Find(std::string_view key) const {
  std::vector<std::string>& keys = document_->known_keys_[table_].keys;
  if (std::find(keys.begin(), keys.end(), key) == keys.end()) keys.emplace_back(key);
  return table_->get(key);
}

void TomlTable::Ignore(std::initializer_list<std::string_view> keys) const {
  for (const std::string_view key : keys) Find(key);
}

void TomlTable::AddAt(const toml::node& node, const std::string& path, std::string what) const {
  document_->faults_.Add({Fault::Severity::kFault, document_->file_, LineOfNode(node), path,
                          ValueText(node) + " " + std::move(what)});
}

void TomlTable::AddEntry(Fault::Severity severity, std::string_view key,
                         std::string_view what) const {
  const toml::node* node = key.empty() ? nullptr : Find(key);
  std::string text = node != nullptr && !node->is_table() && !node->is_array_of_tables()
                         ? ValueText(*node) + " "
                         : "";
  document_->faults_.Add(
      {severity, document_->file_, LineOf(key), PathOf(key), text + std::string(what)});
}

void TomlTable::AddFault(std::string_view key, std::string_view what) const {
  AddEntry(Fault::Severity::kFault, key, what);
}

void TomlTable::AddWarning(std::string_view key, std::string_view what) const {
  AddEntry(Fault::Severity::kWarning, key, what);
}

void TomlTable::AddMissing(std::string_view key, std::string_view expected) const {
  Find(key);
  document_->faults_.Add({Fault::Severity::kFault, document_->file_, Line(), PathOf(key),
                          fmt::format("missing; expected {}", expected)});
}

std::optional<double> TomlTable::NumberFrom(const toml::node& node, const std::string& path,
                                            NumberRange range) const {
  double value = 0;
  if (const auto* floating = node.as_floating_point()) {
    value = floating->get();
  } else if (const auto* integer = node.as_integer()) {
    value = static_cast<double>(integer->get());
  } else {
    AddAt(node, path, "is not a number");
    return std::nullopt;
  }
  if (!std::isfinite(value)) {
    AddAt(node, path, "is not a finite number");
    return std::nullopt;
  }
  if (value < range.min || value > range.max) {
    AddAt(node, path, OutsideText(range.min, range.max));
    return std::nullopt;
  }
  return value * range.to_si;
}

std::optional<int> TomlTable::IntegerFrom(const toml::node& node, const std::string& path, int min,
                                          int max) const {
  const auto* integer = node.as_integer();
  if (integer == nullptr) {
    AddAt(node, path, "is not an integer");
    return std::nullopt;
  }
  if (integer->get() < min || integer->get() > max) {
    AddAt(node, path, OutsideText(min, max));
    return std::nullopt;
  }
  return static_cast<int>(integer->get());
}

std::optional<std::string> TomlTable::StringFrom(const toml::node& node,
                                                 const std::string& path) const {
  const auto* string = node.as_string();
  if (string == nullptr || string->get().empty()) {
    AddAt(node, path, string == nullptr ? "is not a string in quotes" : "is empty");
    return std::nullopt;
  }
  if (string->get().find_first_of("\r\n") != std::string::npos) {  // could forge a line of a report
    document_->faults_.Add({Fault::Severity::kFault, document_->file_, LineOfNode(node), path,
                            "contains a line break; write the text in one line"});
    return std::nullopt;
  }
  return string->get();
}

std::optional<double> TomlTable::Number(std::string_view key, NumberRange range) const {
  const toml::node* node = Find(key);
  if (node == nullptr) return std::nullopt;
  return NumberFrom(*node, PathOf(key), range);
}

std::optional<double> TomlTable::RequiredNumber(std::string_view key, NumberRange range) const {
  if (!Has(key)) AddMissing(key, "a number, " + RangeText(range));
  return Number(key, range);
}

std::optional<int> TomlTable::Integer(std::string_view key, int min, int max) const {
  const toml::node* node = Find(key);
  if (node == nullptr) return std::nullopt;
  return IntegerFrom(*node, PathOf(key), min, max);
}

std::optional<int> TomlTable::RequiredInteger(std::string_view key, int min, int max) const {
  if (!Has(key)) AddMissing(key, fmt::format("an integer, {}..{}", min, max));
  return Integer(key, min, max);
}

std::optional<bool> TomlTable::Bool(std::string_view key) const {
  const toml::node* node = Find(key);
  if (node == nullptr) return std::nullopt;
  if (const auto* value = node->as_boolean()) return value->get();
  AddAt(*node, PathOf(key), "is not true or false");
  return std::nullopt;
}

std::optional<std::string> TomlTable::String(std::string_view key) const {
  const toml::node* node = Find(key);
  if (node == nullptr) return std::nullopt;
  return StringFrom(*node, PathOf(key));
}

std::optional<std::string> TomlTable::Date(std::string_view key) const {
  const toml::node* node = Find(key);
  if (node == nullptr) return std::nullopt;
  if (const auto* date = node->as_date()) {
    return fmt::format("{:04}-{:02}-{:02}", date->get().year, date->get().month, date->get().day);
  }
  AddAt(*node, PathOf(key), "is not a date without quotes, such as 2019-05-01");
  return std::nullopt;
}

std::optional<std::string> TomlTable::RequiredString(std::string_view key) const {
  if (!Has(key)) AddMissing(key, "a string in quotes");
  return String(key);
}

std::string TomlTable::OneOfText(const std::vector<std::string_view>& words) {
  return fmt::format("one of \"{}\"", fmt::join(words, "\", \""));
}

std::optional<std::size_t> TomlTable::OneOf(std::string_view key,
                                            const std::vector<std::string_view>& words) const {
  const toml::node* node = Find(key);
  if (node == nullptr) return std::nullopt;
  if (const auto* string = node->as_string()) {
    const auto found = std::find(words.begin(), words.end(), string->get());
    if (found != words.end()) return static_cast<std::size_t>(found - words.begin());
  }
  AddAt(*node, PathOf(key), fmt::format("is not one of \"{}\"", fmt::join(words, "\", \"")));
  return std::nullopt;
}

const toml::array* TomlTable::FindArray(std::string_view key, std::string_view expected,
                                        int size) const {
  const toml::node* node = Find(key);
  if (node == nullptr) return nullptr;
  const toml::array* array = node->as_array();
  if (array == nullptr || (size >= 0 && static_cast<int>(array->size()) != size)) {
    const std::string count = size >= 0 ? fmt::format("{} ", size) : "";
    AddAt(*node, PathOf(key), fmt::format("is not a list of {}{}", count, expected));
    return nullptr;
  }
  return array;
}

std::optional<std::vector<double>> TomlTable::Numbers(std::string_view key, NumberRange range,
                                                      int size) const {
  const toml::array* array = FindArray(key, "numbers", size);
  if (array == nullptr) return std::nullopt;
  std::vector<double> values;
  std::size_t place = 0;
  for (const toml::node& element : *array) {
    const std::string path = fmt::format("{}[{}]", PathOf(key), ++place);
    if (const auto value = NumberFrom(element, path, range)) values.push_back(*value);
  }
  if (values.size() != array->size()) return std::nullopt;
  return values;
}

std::optional<std::vector<int>> TomlTable::Integers(std::string_view key, int min, int max) const {
  const toml::array* array = FindArray(key, "integers", -1);
  if (array == nullptr) return std::nullopt;
  std::vector<int> values;
  std::size_t place = 0;
  for (const toml::node& element : *array) {
    const std::string path = fmt::format("{}[{}]", PathOf(key), ++place);
    if (const auto value = IntegerFrom(element, path, min, max)) values.push_back(*value);
  }
  if (values.size() != array->size()) return std::nullopt;
  return values;
}

std::optional<std::vector<std::string>> TomlTable::Strings(std::string_view key) const {
  const toml::array* array = FindArray(key, "strings", -1);
  if (array == nullptr) return std::nullopt;
  std::vector<std::string> values;
  std::size_t place = 0;
  for (const toml::node& element : *array) {
    const std::string path = fmt::format("{}[{}]", PathOf(key), ++place);
    if (auto value = StringFrom(element, path)) values.push_back(std::move(*value));
  }
  if (values.size() != array->size()) return std::nullopt;
  return values;
}

std::optional<Vec3> TomlTable::Vector3(std::string_view key, NumberRange range) const {
  const auto values = Numbers(key, range, 3);
  if (!values) return std::nullopt;
  return Vec3((*values)[0], (*values)[1], (*values)[2]);
}

std::optional<Vec3> TomlTable::RequiredVector3(std::string_view key, NumberRange range) const {
  if (!Has(key)) AddMissing(key, "3 numbers, " + RangeText(range));
  return Vector3(key, range);
}

std::optional<Eigen::MatrixXd> TomlTable::Matrix(std::string_view key, NumberRange range, int rows,
                                                 int columns) const {
  const std::string expected = fmt::format("lists of {} numbers", columns);
  const toml::array* array = FindArray(key, expected, rows);
  if (array == nullptr) return std::nullopt;
  Eigen::MatrixXd matrix(rows, columns);
  bool good = true;
  for (int row = 0; row < rows; ++row) {
    const toml::node& element = *array->get(static_cast<std::size_t>(row));
    const std::string path = fmt::format("{}[{}]", PathOf(key), row + 1);
    const toml::array* numbers = element.as_array();
    if (numbers == nullptr || static_cast<int>(numbers->size()) != columns) {
      AddAt(element, path, fmt::format("is not a list of {} numbers", columns));
      good = false;
      continue;
    }
    for (int column = 0; column < columns; ++column) {
      const auto value = NumberFrom(*numbers->get(static_cast<std::size_t>(column)),
                                    fmt::format("{}[{}]", path, column + 1), range);
      good = good && value;
      matrix(row, column) = value.value_or(0);
    }
  }
  if (!good) return std::nullopt;
  return matrix;
}

std::optional<Eigen::MatrixXd> TomlTable::Rows(std::string_view key, NumberRange range) const {
  const toml::array* array = FindArray(key, "lists of numbers", -1);
  if (array == nullptr) return std::nullopt;
  const toml::array* first = array->empty() ? nullptr : array->get(0)->as_array();
  const std::size_t columns = first != nullptr ? first->size() : 0;
  return Matrix(key, range, static_cast<int>(array->size()), static_cast<int>(columns));
}

std::optional<TomlTable> TomlTable::Table(std::string_view key) const {
  const toml::node* node = Find(key);
  if (node == nullptr || IsEmptyTable(*node)) return std::nullopt;
  return RequiredTable(key);
}

std::optional<TomlTable> TomlTable::RequiredTable(std::string_view key) const {
  const toml::node* node = Find(key);
  if (node == nullptr) {
    AddMissing(key, fmt::format("the table [{}]", PathOf(key)));
    return std::nullopt;
  }
  if (const auto* table = node->as_table()) return TomlTable(*document_, *table, PathOf(key));
  AddAt(*node, PathOf(key), fmt::format("is not a table; write [{}]", PathOf(key)));
  return std::nullopt;
}

std::vector<TomlTable> TomlTable::Tables(std::string_view key) const {
  std::vector<TomlTable> tables;
  const toml::node* node = Find(key);
  if (node == nullptr || IsEmptyTable(*node)) return tables;
  const toml::array* array = node->as_array();
  if (array == nullptr) {
    AddAt(*node, PathOf(key), fmt::format("is not a list of tables; write [[{}]]", PathOf(key)));
    return tables;
  }
  std::size_t place = 0;
  for (const toml::node& element : *array) {
    const std::string path = fmt::format("{}[{}]", PathOf(key), ++place);
    if (const auto* table = element.as_table()) {
      tables.push_back(TomlTable(*document_, *table, path));
    } else {
      AddAt(element, path, "is not a table");
    }
  }
  return tables;
}

std::vector<TomlTable> TomlTable::TableOrTables(std::string_view key) const {
  const toml::node* node = Find(key);
  if (node == nullptr || !node->is_table() || IsEmptyTable(*node)) return Tables(key);
  return {*Table(key)};
}

}  // namespace plumbline::config
