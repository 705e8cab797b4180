#include "app/base/text/vrml_tokens.h"

#include <catch2/catch.hpp>
#include <string>

namespace plumbline::vrml_tokens_test {

using plumbline::text::VrmlReference;
using plumbline::text::VrmlReferences;
using plumbline::text::VrmlToken;
using plumbline::text::VrmlTokens;

namespace {

std::string References(const std::string& text, std::size_t most = 8) {
  std::string found;
  for (const VrmlReference& one : VrmlReferences(text, most)) {
    CHECK(text.compare(one.at, one.node.size(), one.node) == 0);
    found += std::string(one.node) + " " + std::string(one.file) + ";";
  }
  return found;
}

}  // namespace

TEST_CASE("words, strings and brackets of VRML; blanks, commas and comments between them") {
  VrmlTokens tokens("a,b{\"x \\\" # }\"# c \"\n]\t-1.5");
  std::string seen;
  for (VrmlToken token = tokens.Next(); !token.at_end(); token = tokens.Next()) {
    seen += (token.string ? "'" : "") + std::string(token.text) + "|";
  }
  CHECK(seen == "a|b|{|'x \\\" # }|]|-1.5|");
  CHECK(VrmlTokens("\"open").Next().text == "open");
  CHECK(VrmlTokens("\"\\").Next().text == "\\");
  CHECK(VrmlTokens("\"\"").Next().string);
}

TEST_CASE("references to other files are nodes, not names, comments or strings") {
  CHECK(References("Inline { url \"a.wrl\" }") == "Inline a.wrl;");
  CHECK(References("DEF X Inline{bboxSize 1 1 1 url [ \"a.wrl\", \"b.wrl\" ]}") == "Inline a.wrl;");
  CHECK(References("EXTERNPROTO P [ field SFVec3f s ] \"p.wrl#P\"") == "EXTERNPROTO p.wrl#P;");
  CHECK(References("EXTERNPROTO P [ ] [ \"p.wrl\" \"q.wrl\" ] P { } Inline { url \"c.wrl\" }") ==
        "EXTERNPROTO p.wrl;Inline c.wrl;");
  CHECK(References("Separator { WWWInline { name \"a.wrl\" } File { name \"b.iv\" } }") ==
        "WWWInline a.wrl;File b.iv;");
  CHECK(References("DEF InlineFour Shape { appearance Appearance { texture ImageTexture { url "
                   "\"wood.png\" } } }")
            .empty());
  CHECK(References("DEF Inline Shape { } USE Inline # Inline { url \"a.wrl\" }").empty());
  CHECK(References("WorldInfo { title \"Inline { url\" info [ \"EXTERNPROTO\" ] }").empty());
  // The address of another node is not that of the reference.
  CHECK(References("Inline { } ImageTexture { url \"wood.png\" }") == "Inline ;");
  CHECK(References("Inline { url \"") == "Inline ;");
  CHECK(References("EXTERNPROTO") == "EXTERNPROTO ;");
  std::string many;
  for (int k = 0; k < 100'000; ++k) many += "Inline { url \"a\" }";
  CHECK(VrmlReferences(many, 8).size() == 8);
}

}  // namespace plumbline::vrml_tokens_test
