// Fuzzer: arbitrary bytes as everything that a cell says of itself and a viewer selects. The page
// has no other tags than its own, no attribute that the page does not write, and no address that a
// browser would run.
#include <array>
#include <cstdlib>
#include <string_view>

#include "app/base/http/html_text.h"
#include "app/plant/page/wall.h"

namespace {

using namespace plumbline;

constexpr std::string_view kTags[] = {
    "!doctype", "html",   "head",   "meta", "title",   "link", "script", "body",  "header",
    "span",     "div",    "h1",     "h2",   "h3",      "p",    "form",   "label", "input",
    "select",   "option", "button", "main", "section", "ol",   "li",     "a",     "footer"};
constexpr std::string_view kAddresses[] = {"icon.svg", "page.css", "status.json", "http://",
                                           "https://"};

/// The next field, up to a line feed.
std::string Field(std::string_view& bytes) {
  const std::size_t end = std::min(bytes.find('\n'), bytes.size());
  std::string field(bytes.substr(0, end));
  bytes.remove_prefix(std::min(end + 1, bytes.size()));
  return field;
}

std::string Lower(std::string_view text) {
  std::string lower(text);
  for (char& c : lower) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c;
  return lower;
}

void CheckTags(const std::string& html) {
  for (std::size_t at = html.find('<'); at != std::string::npos; at = html.find('<', at + 1)) {
    std::string_view tag = std::string_view(html).substr(at + 1);
    if (tag.starts_with('/')) tag.remove_prefix(1);
    const std::string name = Lower(tag.substr(0, tag.find_first_of(" >")));
    if (std::find(std::begin(kTags), std::end(kTags), name) == std::end(kTags)) std::abort();
    const std::string_view inside = tag.substr(0, tag.find('>'));
    // Attributes are quoted, so an odd number means that a text broke out of one.
    if (std::count(inside.begin(), inside.end(), '"') % 2 != 0) std::abort();
    const std::size_t address = inside.find("href=\"");
    if (address == std::string_view::npos) continue;
    const std::string value = Lower(inside.substr(address + 6));
    const bool known =
        std::any_of(std::begin(kAddresses), std::end(kAddresses),
                    [&](std::string_view begin) { return value.starts_with(begin); });
    if (!known) std::abort();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string all(reinterpret_cast<const char*>(data), size);
  std::string_view bytes = all;
  plant::CellState cell;
  const std::array fields = {&cell.line,          &cell.node,       &cell.name,
                             &cell.arm_model,     &cell.arm_series, &cell.page,
                             &cell.health_reason, &cell.stale_lens, &cell.refused_reason};
  for (std::string* const field : fields) *field = Field(bytes);
  plant::WallSelection selection{Field(bytes), Field(bytes), size % 2 == 0};
  cell.born = cell.online = size % 3 != 0;
  cell.health = static_cast<int>(size % 7);
  cell.received_utc = cell.refused_utc = 1e9;
  const plant::Wall wall = plant::WallFrom({cell}, 1e9, {});
  CheckTags(plant::WallHtml(wall, selection, "start", cell.health_reason));
  for (const plant::WallCard& card : wall.cards) CheckTags(card.html);
  if (plant::WallUpdateJson(wall, 0, "start", all).empty()) std::abort();
  if (plant::VersionFromText(all, "start") > 0 && !all.starts_with("start-")) std::abort();
  const std::string escaped = http::EscapedHtml(all);
  if (escaped.find_first_of("<>\"'") != std::string::npos) std::abort();
  return 0;
}
