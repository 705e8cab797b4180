#include "app/base/target/declared_facts.h"

namespace plumbline::target {

DeclaredFacts MissingOf(const DeclaredFacts& needed, const DeclaredFacts& declared) {
  return {needed.no_window && !declared.no_window, needed.fixed_focus && !declared.fixed_focus};
}

bool Includes(const DeclaredFacts& declared, const DeclaredFacts& needed) {
  return MissingOf(needed, declared) == DeclaredFacts{};
}

std::string TextOf(const DeclaredFacts& facts) {
  std::string text = facts.no_window ? "no_window" : "";
  if (facts.fixed_focus) text += text.empty() ? "fixed_focus" : ", fixed_focus";
  return text;
}

}  // namespace plumbline::target
