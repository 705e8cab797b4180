#include "app/measure/imports/decimal_signs.h"

#include <fmt/format.h>

#include <algorithm>

namespace plumbline::measure {
namespace {

/// Values of one kind: how many, and the first one with its line.
struct Examples {
  int count = 0;
  std::string first;

  void Add(const std::string& field, int line) {
    if (++count == 1) first = fmt::format("\"{}\" in line {}", field.substr(0, 40), line);
  }
};

/// How the values of a column use the two signs.
struct SignUse {
  Examples own, other;    ///< with the file's decimal sign; that can only have the other one
  Examples unclear;       ///< that allow both
  bool grouped = false;   ///< a value proves that the other sign separates thousands
  std::string ambiguous;  ///< the first unclear value itself
};

SignUse SignUseOf(const text::DelimitedText& layout, std::size_t column) {
  const char own = layout.decimal, other = own == ',' ? '.' : ',';
  SignUse use;
  for (const text::Record& record : layout.records) {
    if (column >= record.fields.size()) continue;
    const std::string& field = record.fields[column];
    const bool has_own = field.find(own) != std::string::npos;
    const bool has_other = field.find(other) != std::string::npos;
    const bool as_own = text::NumberIn(field, own).has_value();
    const bool as_other = text::NumberIn(field, other).has_value();
    if (has_own && as_own) use.own.Add(field, record.line);
    if (!has_other) continue;
    if (as_own && as_other) {
      if (use.unclear.count == 0) use.ambiguous = field.substr(0, 40);
      use.unclear.Add(field, record.line);
    } else if (as_own) {
      use.grouped = true;
    } else if (as_other) {
      use.other.Add(field, record.line);
    }
  }
  return use;
}

const char* SignName(char sign) {
  return sign == ',' ? "comma" : "point";
}

std::string ColumnText(const text::DelimitedText& layout, std::size_t column) {
  const std::string& name = layout.names[column];
  return name.empty() ? fmt::format("column {}", column + 1)
                      : fmt::format("column \"{}\"", name.substr(0, 40));
}

bool HoldsNumbers(const ColumnMeaning& meaning) {
  const auto kind = KindOfTarget(meaning.target);
  return kind && *kind != ValueKind::kText;
}

/// "81.41 or 81410"
std::string ReadingsText(const std::string& field) {
  const auto [low, high] =
      std::minmax({text::NumberIn(field, ',').value_or(0), text::NumberIn(field, '.').value_or(0)});
  return fmt::format("{:.10g} or {:.10g}", low, high);
}

config::Fault FaultAt(const UnderstoodFile& file, std::size_t column, std::string what) {
  return {config::Fault::Severity::kFault, file.file, file.layout.header_line,
          ColumnText(file.layout, column), std::move(what)};
}

/// The fault of a file of which some columns have the other sign.
config::Fault DifferentSigns(const UnderstoodFile& file, const std::vector<SignUse>& uses,
                             const std::vector<std::size_t>& columns) {
  const char own = file.layout.decimal, other = own == ',' ? '.' : ',';
  const SignUse& first = uses[columns.front()];
  std::string what = fmt::format("has a decimal {} ({})", SignName(other), first.other.first);
  if (columns.size() > 1) {
    std::vector<std::string> further;
    for (std::size_t i = 1; i < columns.size(); ++i) {
      further.push_back(ColumnText(file.layout, columns[i]));
    }
    what += fmt::format(", like {}", fmt::join(further, ", "));
  }
  const auto with_own = std::ranges::find_if(
      uses, [](const SignUse& use) { return use.own.count > use.other.count; });
  if (with_own == uses.end()) {
    return FaultAt(file, columns.front(),
                   what + fmt::format(", but the decimal sign is stated as {}; give --decimal {} "
                                      "or correct the mapping",
                                      SignName(own), SignName(other)));
  }
  what += fmt::format(", but {} has a decimal {} ({}); no row is read, since ",
                      ColumnText(file.layout, static_cast<std::size_t>(with_own - uses.begin())),
                      SignName(own), with_own->own.first);
  what += first.ambiguous.empty()
              ? "a comma or point could then separate thousands"
              : fmt::format("\"{}\" could be {}", first.ambiguous, ReadingsText(first.ambiguous));
  return FaultAt(file, columns.front(), what + ". Export the file with one decimal sign");
}

}  // namespace

std::set<std::size_t> CheckDecimalSigns(const UnderstoodFile& file, bool stated,
                                        config::FaultList& faults) {
  std::vector<SignUse> uses(file.meanings.size());
  std::vector<std::size_t> different;
  std::set<std::size_t> rejecting;
  for (std::size_t i = 0; i < file.meanings.size(); ++i) {
    if (!HoldsNumbers(file.meanings[i])) continue;
    uses[i] = SignUseOf(file.layout, i);
    if (uses[i].other.count > 0) rejecting.insert(i);
    if (uses[i].other.count > uses[i].own.count) different.push_back(i);
  }
  if (!different.empty()) faults.Add(DifferentSigns(file, uses, different));
  for (std::size_t i = 0; i < uses.size() && different.empty() && !stated; ++i) {
    const SignUse& use = uses[i];
    if (use.unclear.count == 0 || use.grouped || use.other.count > 0) continue;
    const char own = file.layout.decimal;
    faults.Add(FaultAt(
        file, i,
        fmt::format("holds {}, which may be {}: the decimal sign of the file is the {}, but "
                    "nothing in this column proves thousands separators; export the file with one "
                    "decimal sign, or give --decimal {} if they are thousands",
                    use.unclear.first, ReadingsText(use.ambiguous), SignName(own), SignName(own))));
    break;
  }
  return rejecting;
}

}  // namespace plumbline::measure
