// Names of declared facts, and comparison of what was declared when.
#pragma once

#include <string>

#include "app/lens/declared_facts.h"

namespace plumbline::lens {

/// The facts that `needed` has and `declared` lacks.
DeclaredFacts MissingOf(const DeclaredFacts& needed, const DeclaredFacts& declared);

/// Whether everything that `needed` declares is declared.
bool Includes(const DeclaredFacts& declared, const DeclaredFacts& needed);

/// "no_window, fixed_focus", the names of the keys; empty if nothing is declared.
std::string TextOf(const DeclaredFacts& facts);

}  // namespace plumbline::lens
