// Table of the kinds of files that are recognised.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "app/base/recognition/outline.h"
#include "app/base/recognition/recognition.h"

namespace plumbline::recognition {

/// One kind, complete: how it is recognised, what is read from it, and what can be done with it.
struct Kind {
  std::string_view id, name;
  Content content;
  /// The line that only this kind has; nullopt if the file is none of this kind.
  std::optional<Fact> (*shown)(const Outline&);
  /// Adds facts, contradictions and what is undecided; nullptr: there are none.
  void (*read)(const Outline&, Recognition&);
  /// With {} for the file; empty if no command reads it.
  std::string_view command;
  /// How to convert it, {} for the file; empty if a command reads it as it is.
  std::string_view conversion;
};

/// In the order in which they are tried: the more specific first.
std::span<const Kind> AllKinds();

// The rows of each family; AllKinds() puts them in order.
std::span<const Kind> BinaryKinds();
std::span<const Kind> LensKinds();
std::span<const Kind> KinematicsKinds();
std::span<const Kind> OwnKinds();
std::span<const Kind> MeshKinds();
std::span<const Kind> ProgramKinds();
std::span<const Kind> TableKinds();

// Helpers of the rows.

/// The line of an entry as evidence; nullopt for nullptr.
std::optional<Fact> Shown(const Entry* entry);
std::optional<Fact> Shown(const Line* line);
/// The evidence of a magic number: `shown` in words.
std::optional<Fact> FirstBytes(const Outline& file, std::string_view magic, const char* shown,
                               std::size_t at = 0);
/// How often a part occurs in a text, without overlaps.
std::size_t CountIn(std::string_view text, std::string_view part);
/// Part of the file in a message: one line, at most `longest` bytes.
std::string Quoted(std::string_view text, std::size_t longest = 60);

/// Contradicts rows with another number of fields than there are names, names that come twice, and
/// numbers before the names.
void CheckTable(const Outline& file, const text::DelimitedText& table, Recognition& found);

/// Whether the name of a column ends in a unit: q1_deg, "X [mm]".
bool StatesUnit(std::string_view name);
/// Contradicts angles declared in degrees that look like radians: all are at most 2 pi, and one is
/// pi or pi/2 to its last digit.
/// @param columns  places of the columns in degrees
void CheckDegrees(const text::DelimitedText& table, const std::vector<std::size_t>& columns,
                  Recognition& found);
/// Contradicts numbers that are no rotation: a quaternion whose length is not 1.
void CheckQuaternion(const std::vector<double>& numbers, int line, Recognition& found);

inline void AddFact(Recognition& found, std::string what, std::string value, int line = 0) {
  found.facts.push_back({std::move(what), std::move(value), line});
}
inline void Contradict(Recognition& found, std::string what, std::string why, int line = 0) {
  found.contradictions.push_back({std::move(what), std::move(why), line});
}
/// The value of the named entry as a fact, if there is one.
void AddValue(const Outline& file, std::string_view name, const char* what, Recognition& found);

}  // namespace plumbline::recognition
