// What is known about the settings at a step of a program, and where paths meet.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <unordered_map>
#include <vector>

#include "app/programs/flow/flow.h"

namespace plumbline::programs {

inline constexpr std::size_t kPrevious = kSlots;  ///< after the settings: the previous motion
inline constexpr std::size_t kFacts = kSlots + 1;
inline constexpr int kUnreached = -1;
inline constexpr int kAtStart = -1;  ///< in place of a previous motion: none since the start

extern const std::array<const char*, kFacts> kSlotNames;

/// As the user states them where a program is started.
inline constexpr std::array<const char*, kStatedSlots> kEntryNames = {"tool", "base", "load",
                                                                      "extra", "shift"};

/// A value of a slot.
struct Fact {
  int value = 0;  ///< class of the key: equal values share one; not for unknown facts
  bool known = false;
  std::string key;  ///< of a known fact; the reason of an unknown one
  Place place;
  std::vector<int> starts{};  ///< of a known previous motion: all that it may be, ascending
};

/// Facts before a step, by number; kUnreached: no path leads here.
using State = std::array<int, kFacts>;

/// All facts of one program, by number.
class Facts {
 public:
  /// @param program  outlives this
  explicit Facts(const Program& program);

  const Fact& operator[](int number) const { return all_[static_cast<std::size_t>(number)]; }

  int Known(std::size_t slot, const std::string& key, const Place& place);
  int Unknown(std::string reason, const Place& place);
  int Previous(std::string text, const Place& place, std::vector<int> starts);
  int FromSetting(std::size_t slot, const Setting& setting, const Place& place);
  /// What a routine that is in none of the files does to a slot.
  int MissingChanges(std::size_t slot, const Step& step);

  /// The fact of a slot where two paths meet. A slot changes at most twice at any node, the
  /// previous motion as often as there are motions that it may be.
  int Join(std::size_t slot, int here, int other);

 private:
  /// Classes of the keys of one slot: keys with equal values share one.
  using Classes = std::unordered_map<std::string, int>;

  int Add(Fact fact);
  int JoinStarts(int here, int other);
  std::string Conflict(std::size_t slot, const Fact& a, const Fact& b) const;

  const Program& program_;
  std::array<Classes, kSlots> classes_;
  std::vector<Fact> all_;
};

}  // namespace plumbline::programs
