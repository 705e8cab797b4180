#include "app/base/recognition/kinds.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "app/base/text/text.h"

namespace plumbline::recognition {

std::optional<Fact> Shown(const Entry* entry) {
  if (entry == nullptr) return std::nullopt;
  const std::string path = Quoted(entry->path);
  if (entry->value.empty()) return Fact{"", path, entry->line};
  const char* const sign = entry->path.find('@') == std::string::npos ? ": " : " = ";
  return Fact{"", path + sign + Quoted(entry->value), entry->line};
}

std::optional<Fact> Shown(const Line* line) {
  if (line == nullptr) return std::nullopt;
  return Fact{"", Quoted(line->text), line->number};
}

std::optional<Fact> FirstBytes(const Outline& file, std::string_view magic, const char* shown,
                               std::size_t at) {
  const std::string_view bytes = file.bytes();
  if (bytes.size() < at + magic.size() || bytes.substr(at, magic.size()) != magic) {
    return std::nullopt;
  }
  return Fact{"", at == 0 ? fmt::format("first bytes {}", shown) : shown, 0};
}

std::size_t CountIn(std::string_view text, std::string_view part) {
  std::size_t count = 0;
  for (auto at = text.find(part); at != std::string_view::npos;
       at = text.find(part, at + part.size())) {
    ++count;
  }
  return count;
}

std::string Quoted(std::string_view text, std::size_t longest) {
  text = Trimmed(text);
  bool cut = false;
  if (const auto end = text.find_first_of("\r\n"); end != std::string_view::npos) {
    text = Trimmed(text.substr(0, end));
    cut = true;
  }
  if (text.size() > longest) {
    text = text.substr(0, longest);
    // Not within a character of UTF-8.
    while (!text.empty() && (static_cast<unsigned char>(text.back()) & 0xC0U) == 0x80) {
      text.remove_suffix(1);
    }
    if (!text.empty() && (static_cast<unsigned char>(text.back()) & 0x80U) != 0) {
      text.remove_suffix(1);
    }
    cut = true;
  }
  std::string visible = text::Visible(text);
  std::ranges::replace(visible, '\t', ' ');
  while (cut && !visible.empty() && (visible.back() == ' ' || visible.back() == ',')) {
    visible.pop_back();
  }
  return visible + (cut ? " .." : "");
}

void AddValue(const Outline& file, std::string_view name, const char* what, Recognition& found) {
  const Entry* const entry = file.FindName(name);
  if (entry != nullptr && !entry->value.empty()) {
    AddFact(found, what, Quoted(entry->value), entry->line);
  }
}

std::span<const Kind> AllKinds() {
  // Magic numbers first, and tables, which anything may look like, last.
  static const std::vector<Kind> kAll = [] {
    std::vector<Kind> all;
    for (const auto& family : {BinaryKinds(), MeshKinds(), ProgramKinds(), LensKinds(),
                               KinematicsKinds(), OwnKinds(), TableKinds()}) {
      all.insert(all.end(), family.begin(), family.end());
    }
    return all;
  }();
  return kAll;
}

}  // namespace plumbline::recognition
