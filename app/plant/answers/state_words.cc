#include "app/plant/answers/state_words.h"

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
