#include "app/plant/answers/state_words.h"

#include <fmt/format.h>

#include <map>

#include "firmware-like/cell_health.h"

namespace plumbline::plant {

StateWord WordOf(const RankedCell& cell) {
  if (cell.absent) return {"unknown", "○", "NO DATA"};
  switch (UrgencyOf(cell.findings)) {
    case Urgency::kAlarm:
      return {"alarm", "■", Describe(HealthSeverity::kAlarm)};
    case Urgency::kAttention:
    case Urgency::kAbsent:
      return {"warning", "▲", Describe(HealthSeverity::kAttention)};
    case Urgency::kNotice:
      return {"advisory", "i", Describe(HealthSeverity::kNotice)};
    case Urgency::kNone:
      break;
  }
  return {"healthy", "●", Describe(HealthSeverity::kGood)};
}

std::vector<std::string> CountsByWord(const std::vector<RankedCell>& cells) {
  std::map<std::string, int> counts;
  for (const RankedCell& cell : cells) ++counts[WordOf(cell).word];
  std::vector<std::string> texts;
  for (const char* const word : {"ALARM", "ATTENTION", "NO DATA", "NOTE", "OK"}) {
    if (counts[word] > 0) texts.push_back(fmt::format("{} {}", counts[word], word));
  }
  return texts;
}

std::string LowerCase(std::string_view text) {
  std::string lower(text);
  for (char& c : lower) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c;
  return lower;
}

std::string ShownName(const std::string& node, const std::string& name) {
  const auto plain = [](const std::string& text) {
    std::string letters;
    for (const char c : LowerCase(text)) {
      if (c != ' ' && c != '-' && c != '_') letters += c;
    }
    return letters;
  };
  return plain(node) == plain(name) ? name : fmt::format("{} ({})", node, name);
}

std::string Padded(std::string_view text, std::size_t columns) {
  std::string padded;
  std::size_t used = 0, last = 0;  // characters, and where the last of them begins
  for (const char c : text) {
    const bool continues = (static_cast<unsigned char>(c) & 0xC0U) == 0x80U;
    if (!continues) {
      if (used == columns) {
        padded.resize(last);
        return padded + "…";
      }
      ++used;
      last = padded.size();
    }
    padded += c;
  }
  return padded + std::string(columns - used, ' ');
}

}  // namespace plumbline::plant
