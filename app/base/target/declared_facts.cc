#include "app/base/target/declared_facts.h"

namespace plumbline::target {

DeclaredFacts MissingOf(const DeclaredFacts& needed, const DeclaredFacts& declared) {
  return {needed.no_window && !declared.no_window, needed.fixed_focus && !declared.fixed_focus,
          needed.oblong_pixels && !declared.oblong_pixels};
}

bool Includes(const DeclaredFacts& declared, const DeclaredFacts& needed) {
  return MissingOf(needed, declared) == DeclaredFacts{};
}

std::string TextOf(const DeclaredFacts& facts) {
  std::string text;
  const auto add = [&](bool declared, const char* name) {
    if (declared) text += (text.empty() ? "" : ", ") + std::string(name);
  };
  add(facts.no_window, "no_window");
  add(facts.fixed_focus, "fixed_focus");
  add(facts.oblong_pixels, "oblong_pixels");
  return text;
}

}  // namespace plumbline::target
