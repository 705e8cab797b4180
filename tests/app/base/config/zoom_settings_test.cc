#include "app/base/config/zoom_settings.h"

#include <array>
#include <catch2/catch.hpp>
#include <map>

namespace plumbline::zoom_settings_test {

using namespace plumbline::config;

namespace {

std::string LineFault(zoom::ZoomConnection& to) {
  return to.gpio.line == 13 ? "is used by the brake" : "";
}

// Two kinds that share `timeout_ms`; the options are stored in members of the existing kinds.
constexpr zoom::ZoomOption kEncoderOptions[] = {
    {.key = "channel",
     .value = [](zoom::ZoomConnection& to) -> std::string& { return to.gpio.chip; },
     .description = "channel of the encoder",
     .example = "\"A\"",
     .required = true},
    {.key = "tooth",
     .value = [](zoom::ZoomConnection& to) -> int& { return to.gpio.line; },
     .max = 100,
     .description = "tooth of the ring",
     .fault = LineFault},
    {.key = "inverted",
     .value = [](zoom::ZoomConnection& to) -> bool& { return to.gpio.active_low; },
     .description = "true: counts downwards"},
    {.key = "timeout_ms",
     .value = [](zoom::ZoomConnection& to) -> double& { return to.hid.timeout_s; },
     .min = 10,
     .max = 1000,
     .to_si = zoom::kSecondPerMs,
     .description = "timeout of one request"},
    {.key = "table", .value = zoom::FileOption{}, .description = "calibration of the encoder"},
};
constexpr zoom::ZoomOption kRulerOptions[] = {
    {.key = "timeout_ms",
     .value = [](zoom::ZoomConnection& to) -> double& { return to.visca.timeout_s; },
     .min = 10,
     .max = 1000,
     .to_si = zoom::kSecondPerMs},
};
constexpr zoom::ZoomKind kEncoder{.name = "encoder", .options = kEncoderOptions};
constexpr zoom::ZoomKind kRuler{.name = "ruler", .options = kRulerOptions};
constexpr std::array<const zoom::ZoomKind*, 2> kKinds = {&kEncoder, &kRuler};

struct Read {
  std::string faults;
  zoom::ZoomConnection connection;

  Read(std::string_view kind, const std::string& keys) {
    FaultList list;
    TomlDocument document("[zoom]\n" + keys, "plumbline.toml", list);
    const auto table = document.Root().RequiredTable("zoom");
    REQUIRE(table);
    Settings settings(*table);
    ListKindKeys(settings, kKinds, kind, connection);
    document.ReportUnknownKeys();
    faults = FaultsText(list);
  }
  bool Reports(const std::string& what) const { return faults.find(what) != std::string::npos; }
};

}  // namespace

TEST_CASE("the options that a zoom sensor kind declares are read into its members, in SI") {
  const Read read("encoder", R"(channel = "B"
tooth = 7
inverted = true
timeout_ms = 250
table = "encoder.csv"
)");
  CHECK(read.faults.empty());
  CHECK(read.connection.gpio.chip == "B");
  CHECK(read.connection.gpio.line == 7);
  CHECK(read.connection.gpio.active_low);
  CHECK(read.connection.hid.timeout_s == Approx(0.25));
}

TEST_CASE("every fault of a kind's options is found in one pass") {
  const Read read("encoder", "tooth = 13\ntimeout_ms = 5\ninvertd = true\n");
  CHECK(read.Reports("plumbline.toml:1 zoom.channel: "));
  CHECK(read.Reports("plumbline.toml:2 zoom.tooth: 13 is used by the brake"));
  CHECK(read.Reports("plumbline.toml:3 zoom.timeout_ms: 5 is outside 10..1000"));
  CHECK(read.Reports("plumbline.toml:4 zoom.invertd: "));
  CHECK(read.Reports("did you mean \"inverted\""));
}

TEST_CASE("a shared key is stored by the selected kind, which alone requires its keys") {
  const Read read("ruler", "timeout_ms = 250\n");
  CHECK(read.faults.empty());
  CHECK(read.connection.visca.timeout_s == Approx(0.25));
  CHECK(read.connection.hid.timeout_s == Approx(0.1));
}

TEST_CASE("each option is documented once, with the member's initial value as its default") {
  std::vector<Setting> rows;
  Settings settings(rows);
  zoom::ZoomConnection connection;
  ListKindKeys(settings, kKinds, "", connection);
  REQUIRE(rows.size() == 5);
  CHECK(rows[0].key == "channel");
  CHECK(rows[0].type == "text");
  CHECK(rows[1].range == "0..100");
  CHECK(rows[1].value == "0");
  CHECK(rows[3].key == "timeout_ms");
  CHECK(rows[3].value == "100.0");
  CHECK(rows[3].doc.description == "timeout of one request");
  CHECK(rows[4].doc.description == "calibration of the encoder");
}

TEST_CASE("kinds that share a key agree on its type and range, and the first documents it") {
  std::map<std::string_view, const zoom::ZoomOption*> first;
  for (const zoom::ZoomKind* kind : zoom::ZoomKinds()) {
    for (const zoom::ZoomOption& option : kind->options) {
      CAPTURE(kind->name, option.key);
      const auto [found, is_first] = first.emplace(option.key, &option);
      if (is_first) CHECK_FALSE(option.description.empty());
      CHECK(option.value.index() == found->second->value.index());
      CHECK(option.min == found->second->min);
      CHECK(option.max == found->second->max);
      CHECK(option.to_si == found->second->to_si);
    }
  }
}

}  // namespace plumbline::zoom_settings_test
