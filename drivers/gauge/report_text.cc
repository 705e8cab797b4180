#include "drivers/gauge/report_text.h"

#include <algorithm>

namespace plumbline::gauge {
namespace {

constexpr std::size_t kBootReportBytes = 8;
constexpr std::uint8_t kShift = 0x22;      // left and right
constexpr std::uint8_t kOtherMods = 0xDD;  // Ctrl, Alt, GUI

struct Key {
  std::uint8_t usage;
  char plain, shifted;
};

// Usages of page 7. Letters are handled apart.
constexpr Key kKeysOfText[] = {
    {0x2C, ' ', ' '},                                    // space
    {0x28, '\r', '\r'},                                  // Enter
    {0x58, '\r', '\r'},                                  // keypad Enter
    {0x2B, '\r', '\r'},                                  // Tab
    {0x2D, '-', kSubstitute}, {0x38, '-', kSubstitute},  // German layout
    {0x56, '-', '-'},                                    // keypad
    {0x2E, kSubstitute, '+'},                            // = and + of the US layout
    {0x30, '+', kSubstitute},                            // German layout
    {0x57, '+', '+'},                                    // keypad
    {0x37, '.', kSubstitute}, {0x36, '.', kSubstitute},  // comma
    {0x63, '.', '.'},                                    // keypad
};

bool IsBetween(std::uint8_t usage, int first, int last) {
  return usage >= first && usage <= last;
}

char CharacterOf(std::uint8_t usage, std::uint8_t modifiers) {
  if ((modifiers & kOtherMods) != 0) return kSubstitute;
  const bool shift = (modifiers & kShift) != 0;
  if (IsBetween(usage, 0x04, 0x1D)) {
    return static_cast<char>((shift ? 'A' : 'a') + (usage - 0x04));
  }
  const bool row = IsBetween(usage, 0x1E, 0x27), keypad = IsBetween(usage, 0x59, 0x62);
  if (row || keypad) {  // 1 to 9, then 0
    if (row && shift) return kSubstitute;
    return static_cast<char>('0' + (usage - (row ? 0x1E : 0x59) + 1) % 10);
  }
  for (const Key& key : kKeysOfText) {
    if (key.usage == usage) return shift ? key.shifted : key.plain;
  }
  return kSubstitute;
}

bool IsEnd(std::uint8_t byte) {
  return byte == '\r' || byte == '\n';
}

bool IsText(std::uint8_t byte) {
  return byte >= ' ' && byte <= '~';
}

}  // namespace

void KeyReports::Push(std::span<const std::uint8_t> report, std::string& text) {
  if (report.size() > kBootReportBytes) report = report.subspan(1);
  if (report.size() < kBootReportBytes) {
    text += kSubstitute;
    return;
  }
  std::array<std::uint8_t, kKeys> down{};
  std::copy_n(report.begin() + 2, kKeys, down.begin());
  for (const std::uint8_t usage : down) {
    if (usage == 0 || std::find(down_.begin(), down_.end(), usage) != down_.end()) continue;
    text += CharacterOf(usage, report[0]);
  }
  down_ = down;
}

void AppendReportText(std::span<const std::uint8_t> report, std::string& text) {
  bool end_alone = false;
  for (int k = 0; k < 2 && !report.empty() && !IsText(report.front()); ++k) {
    end_alone |= IsEnd(report.front());
    report = report.subspan(1);
  }
  if (end_alone && std::all_of(report.begin(), report.end(), [](auto byte) { return byte == 0; }))
    text += '\r';
  for (std::size_t k = 0; k < report.size(); ++k) {
    if (report[k] == 0) {  // what follows may be left from a longer text
      if (k > 0) text += '\r';
      return;
    }
    text += IsText(report[k]) || IsEnd(report[k]) ? static_cast<char>(report[k]) : kSubstitute;
  }
}

}  // namespace plumbline::gauge
