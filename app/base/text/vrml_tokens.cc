#include "app/base/text/vrml_tokens.h"

#include <algorithm>
#include <array>

namespace plumbline::text {
namespace {

/// Nodes that include another file, and the field that names it.
struct Including {
  std::string_view node, field;
};
constexpr std::array kIncluding = {Including{"Inline", "url"}, Including{"WWWInline", "name"},
                                   Including{"File", "name"}};

/// The first string of `field` in the node whose brace has just been read; reads up to its end.
std::string_view FieldOf(VrmlTokens& tokens, std::string_view field) {
  std::string_view file;
  bool in_field = false;
  int depth = 1;
  for (VrmlToken token = tokens.Next(); !token.at_end(); token = tokens.Next()) {
    depth += token.depth();
    if (depth <= 0) break;
    if (token.string && in_field && file.empty()) file = token.text;
    if (!token.string && token.depth() == 0) in_field = depth == 1 && token.text == field;
  }
  return file;
}

/// The first string behind the name and the interface of an EXTERNPROTO.
std::string_view AddressOfProto(VrmlTokens& tokens) {
  tokens.Next();  // the name
  int depth = 0;
  VrmlToken token = tokens.Next();
  do {
    depth += token.depth();
    token = tokens.Next();
  } while (depth > 0 && !token.at_end());
  if (token.Is("[")) token = tokens.Next();
  return token.string ? token.text : std::string_view();
}

}  // namespace

VrmlToken VrmlTokens::Next() {
  constexpr std::string_view kBlanks = " \t\r\n,", kEnds = " \t\r\n,\"#{}[]";
  for (;;) {
    at_ = std::min(text_.find_first_not_of(kBlanks, at_), text_.size());
    if (at_ == text_.size() || text_[at_] != '#') break;
    at_ = std::min(text_.find('\n', at_), text_.size());
  }
  if (at_ == text_.size()) return {{}, at_, false};
  VrmlToken token{{}, at_, text_[at_] == '"'};
  if (token.string) {
    std::size_t end = at_ + 1;
    while (end < text_.size() && text_[end] != '"') end += text_[end] == '\\' ? 2 : 1;
    end = std::min(end, text_.size());
    token.text = text_.substr(at_ + 1, end - at_ - 1);
    at_ = std::min(end + 1, text_.size());
    return token;
  }
  // A bracket is a token of its own.
  const std::size_t end = std::min(text_.find_first_of(kEnds, at_), text_.size());
  token.text = text_.substr(at_, std::max<std::size_t>(end - at_, 1));
  at_ += token.text.size();
  return token;
}

std::vector<VrmlReference> VrmlReferences(std::string_view text, std::size_t most) {
  std::vector<VrmlReference> references;
  VrmlTokens tokens(text);
  VrmlToken before;
  while (references.size() < most) {
    const VrmlToken token = tokens.Next();
    if (token.at_end()) break;
    if (token.Is("EXTERNPROTO")) {
      references.push_back({token.text, AddressOfProto(tokens), token.at});
    } else if (token.Is("{") && !before.string) {
      // Only a node's type stands before a brace; names behind DEF and USE do not.
      const auto* const row = std::ranges::find(kIncluding, before.text, &Including::node);
      if (row != kIncluding.end()) {
        references.push_back({before.text, FieldOf(tokens, row->field), before.at});
      }
    }
    before = token;
  }
  return references;
}

}  // namespace plumbline::text
