#include "app/base/config/settings.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>

namespace plumbline::config {
namespace {

/// An SI value as TOML, in the unit of the file.
std::string NumberText(double value, NumberRange range) {
  std::string text = fmt::format("{:.10g}", value / range.to_si);
  if (text.find_first_of(".e") == std::string::npos) text += ".0";
  return text;
}

std::string ListText(const Vec3& value, NumberRange range) {
  return fmt::format("[{}, {}, {}]", NumberText(value.x(), range), NumberText(value.y(), range),
                     NumberText(value.z(), range));
}

std::string Quoted(std::string_view text) {
  return text.empty() ? "" : fmt::format("\"{}\"", text);
}

int IntegerMin(NumberRange range) {
  return static_cast<int>(range.min);
}

int IntegerMax(NumberRange range) {
  return static_cast<int>(range.max);
}

}  // namespace

bool Settings::AddRow(std::string_view key, std::string_view type, std::string range,
                      std::string value, const SettingDoc& doc) {
  if (rows_ == nullptr) return false;
  rows_->push_back({std::string(key), std::string(type), std::move(range), std::move(value), doc});
  return true;
}

template <typename Found, typename T>
void Settings::Store(std::string_view key, Found found, T& value) {
  valid_ = valid_ && (found || !table_->Has(key));
  if (found) value = std::move(*found);
}

void Settings::Add(std::string_view key, double& value, NumberRange range, const SettingDoc& doc) {
  std::optional<double> found = value;
  Add(key, found, range, doc);
  if (found) value = *found;
}

void Settings::Add(std::string_view key, std::optional<double>& value, NumberRange range,
                   const SettingDoc& doc) {
  if (AddRow(key, "number", RangeText(range), value ? NumberText(*value, range) : "", doc)) return;
  Store(key, doc.required ? table_->RequiredNumber(key, range) : table_->Number(key, range), value);
}

void Settings::Add(std::string_view key, std::optional<int>& value, NumberRange range,
                   const SettingDoc& doc) {
  if (AddRow(key, "integer", RangeText(range), value ? std::to_string(*value) : "", doc)) return;
  Store(key,
        doc.required ? table_->RequiredInteger(key, IntegerMin(range), IntegerMax(range))
                     : table_->Integer(key, IntegerMin(range), IntegerMax(range)),
        value);
}

void Settings::Add(std::string_view key, Vec3& value, NumberRange range, const SettingDoc& doc) {
  std::optional<Vec3> found = value;
  Add(key, found, range, doc);
  if (found) value = *found;
}

void Settings::Add(std::string_view key, std::optional<Vec3>& value, NumberRange range,
                   const SettingDoc& doc) {
  if (AddRow(key, "3 numbers", RangeText(range), value ? ListText(*value, range) : "", doc)) return;
  Store(key, doc.required ? table_->RequiredVector3(key, range) : table_->Vector3(key, range),
        value);
}

void Settings::Add(std::string_view key, std::optional<std::vector<double>>& value,
                   NumberRange range, const SettingDoc& doc) {
  if (AddRow(key, "numbers", "", "", doc)) return;
  Store(key, table_->Numbers(key, range), value);
}

void Settings::Add(std::string_view key, std::vector<int>& value, NumberRange range,
                   const SettingDoc& doc) {
  if (AddRow(key, "integers", RangeText(range), "", doc)) return;
  Store(key, table_->Integers(key, IntegerMin(range), IntegerMax(range)), value);
}

void Settings::Add(std::string_view key, bool& value, const SettingDoc& doc) {
  if (AddRow(key, "true or false", "", value ? "true" : "false", doc)) return;
  Store(key, table_->Bool(key), value);
}

void Settings::Add(std::string_view key, std::string& value, const SettingDoc& doc) {
  if (AddRow(key, "text", "", Quoted(value), doc)) return;
  Store(key, doc.required ? table_->RequiredString(key) : table_->String(key), value);
}

void Settings::Add(std::string_view key, std::vector<std::string>& value, const SettingDoc& doc) {
  const std::string shown =
      value.empty() ? "" : fmt::format("[\"{}\"]", fmt::join(value, "\", \""));
  if (AddRow(key, "texts", "", shown, doc)) return;
  Store(key, table_->Strings(key), value);
}

void Settings::Path(std::string_view key, std::string& value, const SettingDoc& doc) {
  Add(key, value, doc);
  if (table_ && table_->Has(key) && !value.empty()) value = files_->Resolve(value);
}

std::optional<std::size_t> Settings::Word(std::string_view key, std::string_view value,
                                          const std::vector<std::string_view>& words,
                                          const SettingDoc& doc) {
  if (AddRow(key, "word", fmt::format("\"{}\"", fmt::join(words, "\", \"")), Quoted(value), doc)) {
    return std::nullopt;
  }
  if (doc.required && !table_->Has(key)) table_->AddMissing(key, TomlTable::OneOfText(words));
  std::optional<std::size_t> index;
  Store(key, table_->OneOf(key, words), index);
  return index;
}

void Settings::AddFault(std::string_view key, std::string_view what) {
  if (!table_) return;
  table_->AddFault(key, what);
  valid_ = false;
}

void Settings::Document(std::string_view key, std::string_view type, const SettingDoc& doc) {
  if (!AddRow(key, type, "", "", doc)) table_->Ignore({key});
}

}  // namespace plumbline::config
