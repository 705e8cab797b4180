#include "app/vision/print/paper.h"

#include <algorithm>

namespace plumbline::vision {
namespace {

constexpr Paper kPapers[] = {{"letter", 215.9, 279.4}, {"A4", 210, 297}, {"A3", 297, 420}};

}  // namespace

std::span<const Paper> Papers() {
  return kPapers;
}

std::optional<Paper> PaperOfName(std::string_view name) {
  const auto* const found = std::find_if(std::begin(kPapers), std::end(kPapers),
                                         [&](const Paper& paper) { return paper.name == name; });
  if (found == std::end(kPapers)) return std::nullopt;
  return *found;
}

}  // namespace plumbline::vision
