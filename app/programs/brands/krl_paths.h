// Parts of KRL variables: paths such as "[3].p", and the components of poses.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

#include "app/programs/brands/krl_text.h"

namespace plumbline::programs::krl {

inline constexpr std::array<std::string_view, 6> kPoseComponents = {"x", "y", "z", "a", "b", "c"};
inline constexpr std::array<std::string_view, 6> kJointComponents = {"a1", "a2", "a3",
                                                                     "a4", "a5", "a6"};
inline constexpr std::array<std::string_view, 6> kExternalComponents = {"e1", "e2", "e3",
                                                                        "e4", "e5", "e6"};

std::optional<std::size_t> IndexIn(const std::array<std::string_view, 6>& names,
                                   std::string_view name);

bool IsPoseType(std::string_view type);   ///< E6POS, POS, FRAME
bool IsJointType(std::string_view type);  ///< E6AXIS, AXIS

/// True for an aggregate with the components of a pose or of joints.
bool IsPoint(const Aggregate& aggregate);
bool IsJoints(const Aggregate& aggregate);

// A path names a part of a variable: "" is all of it, "[3]" an element, "[2].p" a component of an
// element, and "[*]" an element that is not known.

/// The first part of a path: "[3]" or ".p".
std::string_view FirstPart(std::string_view path);
/// Whether one of two parts contains the other, for some value of the indices that are not known.
bool Overlap(std::string_view a, std::string_view b);
bool HasUnknownIndex(std::string_view path);
/// The path of the brackets [open, behind) of a statement: whole numbers, or "[*]".
std::string IndexPath(const Statement& statement, std::size_t open, std::size_t behind);

/// True for routines and functions of the controller, which leave tool, base and load as they are
/// and do not change their arguments.
bool IsSystemRoutine(std::string_view name);
/// True for a word that starts a statement or is an operator.
bool IsKeyword(std::string_view word);
/// True for a type that can be used without DECL.
bool IsType(std::string_view word);

}  // namespace plumbline::programs::krl
