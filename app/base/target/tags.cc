#include "app/base/target/tags.h"

#include <algorithm>

namespace plumbline::target {

std::optional<double> TagDatabase::SideOf(int id) const {
  for (const StandaloneTag& tag : tags) {
    if (tag.id == id) return tag.side_m;
  }
  for (const Body& body : bodies) {
    for (const BodyTag& tag : body.tags) {
      if (tag.id == id) return tag.side_m;
    }
  }
  return default_side_m;
}

DrawnBy TagDatabase::DrawnByOf(int id) const {
  for (const StandaloneTag& tag : tags) {
    if (tag.id == id) return tag.drawn_by;
  }
  for (const Body& body : bodies) {
    for (const BodyTag& tag : body.tags) {
      if (tag.id == id) return tag.drawn_by;
    }
  }
  return drawn_by;
}

const Body* TagDatabase::BodyOf(int id) const {
  for (const Body& body : bodies) {
    for (const BodyTag& tag : body.tags) {
      if (tag.id == id) return &body;
    }
  }
  return nullptr;
}

}  // namespace plumbline::target
