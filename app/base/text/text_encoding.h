// Text files of unknown encoding as UTF-8.
#pragma once

#include <string>
#include <string_view>

namespace plumbline::text {

struct DecodedText {
  std::string text;      ///< UTF-8, without byte-order mark
  std::string encoding;  ///< "UTF-8", "UTF-16" or "Windows-1252"
};

/// Decodes by byte-order mark; without one, text that is not valid UTF-8 is taken as Windows-1252,
/// which includes Latin-1's micro and degree signs. The minus sign U+2212 becomes a hyphen. Pure;
/// every input gives a text.
DecodedText DecodedFromBytes(std::string_view bytes);

}  // namespace plumbline::text
