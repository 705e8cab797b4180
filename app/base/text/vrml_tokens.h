// Tokens of VRML and Open Inventor, and the references to other files among them.
#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

namespace plumbline::text {

/// One token; an empty word at the end of the text.
struct VrmlToken {
  std::string_view text;  ///< without the quotes of a string
  std::size_t at = 0;     ///< where it begins
  bool string = false;

  bool Is(std::string_view word) const { return !string && text == word; }
  bool at_end() const { return Is(""); }
  /// +1 for an opening brace or bracket, -1 for a closing one.
  int depth() const {
    if (Is("{") || Is("[")) return 1;
    return Is("}") || Is("]") ? -1 : 0;
  }
};

/// Reads words, strings and brackets; blanks, commas and comments separate them.
class VrmlTokens {
 public:
  explicit VrmlTokens(std::string_view text) : text_(text) {}
  VrmlToken Next();

 private:
  std::string_view text_;
  std::size_t at_ = 0;
};

/// Geometry that is in another file.
struct VrmlReference {
  std::string_view node;  ///< "Inline", "EXTERNPROTO", "WWWInline" or "File"
  std::string_view file;  ///< the first of its addresses; empty if it has none
  std::size_t at = 0;     ///< of the node in the text
};

/// In the order of the text, at most `most`. Linear in the size of the text.
std::vector<VrmlReference> VrmlReferences(std::string_view text, std::size_t most);

}  // namespace plumbline::text
