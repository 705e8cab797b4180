#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <set>

#include "app/base/log/catalogue_text.h"
#include "app/base/log/event.h"

namespace plumbline::catalogue_test {

using namespace plumbline::log;

TEST_CASE("every event has an entry, in order, with a unique name and id") {
  const auto entries = EventCatalogue();
  REQUIRE(entries.size() == static_cast<std::size_t>(Event::kCount));
  std::set<std::string> names, ids;
  for (std::size_t k = 0; k < entries.size(); ++k) {
    INFO(entries[k].name);
    CHECK(static_cast<std::size_t>(entries[k].event) == k);
    CHECK(names.insert(entries[k].name).second);
    CHECK(ids.insert(entries[k].id).second);
    CHECK(std::string(entries[k].id).find_first_not_of("0123456789abcdef") == std::string::npos);
    CHECK(std::string(entries[k].id).size() == 32);
    CHECK(FindEvent(entries[k].name) == &entries[k]);
  }
  CHECK(FindEvent("robot-link") == nullptr);
}

TEST_CASE("every error has a remedy") {
  for (const EventEntry& entry : EventCatalogue()) {
    INFO(entry.name);
    if (entry.level == LogLevel::kError) CHECK(*entry.remedy != '\0');
  }
}

TEST_CASE("the catalogue for journalctl has every id once, with its remedy") {
  const std::string text = JournalCatalogue();
  for (const EventEntry& entry : EventCatalogue()) {
    INFO(entry.name);
    const auto at = text.find(fmt::format("\n-- {}\nSubject: {}\n", entry.id, entry.name));
    REQUIRE(at != std::string::npos);
    const auto end = text.find("\n-- ", at + 1);
    CHECK(text.substr(at, end - at).find(entry.remedy) != std::string::npos);
  }
}

}  // namespace plumbline::catalogue_test
