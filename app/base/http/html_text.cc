#include "app/base/http/html_text.h"

#include <algorithm>

namespace plumbline::http {
namespace {

constexpr std::size_t kMaxAddress = 500;

bool StartsWithScheme(std::string_view text, std::string_view scheme) {
  if (text.size() <= scheme.size()) return false;
  return std::equal(scheme.begin(), scheme.end(), text.begin(), [](char expected, char given) {
    return expected == (given >= 'A' && given <= 'Z' ? static_cast<char>(given + 32) : given);
  });
}

}  // namespace

std::string EscapedHtml(std::string_view text) {
  std::string escaped;
  for (const char c : text) {
    const bool control =
        (static_cast<unsigned char>(c) < 0x20 && c != '\n' && c != '\t') || c == 0x7f;
    switch (c) {
      case '&':
        escaped += "&amp;";
        break;
      case '<':
        escaped += "&lt;";
        break;
      case '>':
        escaped += "&gt;";
        break;
      case '"':
        escaped += "&quot;";
        break;
      case '\'':
        escaped += "&#39;";
        break;
      default:
        if (control) {
          escaped += "\xEF\xBF\xBD";
        } else {
          escaped += c;
        }
    }
  }
  return escaped;
}

std::string WebAddress(std::string_view text) {
  if (text.size() > kMaxAddress) return "";
  if (!StartsWithScheme(text, "http://") && !StartsWithScheme(text, "https://")) return "";
  const bool plain = std::all_of(text.begin(), text.end(), [](char c) {
    return c > ' ' && c < 0x7f &&
           std::string_view("\"'<>\\`{}|^").find(c) == std::string_view::npos;
  });
  return plain ? std::string(text) : "";
}

}  // namespace plumbline::http
