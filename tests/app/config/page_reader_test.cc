#include <catch2/catch.hpp>

#include "app/config/page_config.h"
#include "app/config/toml_reader.h"

namespace plumbline::page_reader_test {

using namespace plumbline::config;

namespace {

struct ReadPage {
  FaultList faults;
  PageConfig page;

  explicit ReadPage(const std::string& lines) {
    TomlDocument document("[page]\n" + lines, "/etc/plumbline.toml", faults);
    REQUIRE(document.parsed());
    page = PageFromToml(*document.Root().Table("page"));
    document.ReportUnknownKeys();
  }
  bool Says(const std::string& what) const {
    return FaultsText(faults).find(what) != std::string::npos;
  }
};

}  // namespace

TEST_CASE("[page]: every key is read; without keys there is no page, and listen is loopback") {
  const ReadPage read(
      "listen = \"0.0.0.0\"\nport = 8080\ntoken = \"9f86d081884c7d659a2feaa0c55ad015\"\n"
      "hosts = [\"Cell7.plant.example\"]\n");
  INFO(FaultsText(read.faults));
  CHECK(read.faults.All().empty());
  CHECK(read.page.listen == "0.0.0.0");
  CHECK(read.page.port == 8080);
  CHECK(read.page.token == "9f86d081884c7d659a2feaa0c55ad015");
  CHECK(read.page.hosts == std::vector<std::string>{"cell7.plant.example"});
  const ReadPage empty("");
  CHECK(empty.faults.All().empty());
  CHECK(empty.page.listen == "127.0.0.1");
  CHECK_FALSE(empty.page.port);
  CHECK(empty.page.token.empty());
}

TEST_CASE("a page that other computers reach requires a token, which no fault contains") {
  CHECK(
      ReadPage("listen = \"0.0.0.0\"\nport = 80\n")
          .Says("plumbline.toml:2 page.listen: \"0.0.0.0\" can be reached from other computers and "
                "therefore requires a token"));
  CHECK(ReadPage("listen = \"192.168.0.10\"\n").Says("requires a token"));
  CHECK(ReadPage("listen = \"::\"\n").Says("requires a token"));
  CHECK(ReadPage("listen = \"127.1.2.3\"\n").faults.All().empty());
  CHECK(ReadPage("listen = \"::1\"\n").faults.All().empty());
  CHECK(ReadPage("listen = \"office\"\n").Says("is not an IP address"));
  const ReadPage weak("listen = \"0.0.0.0\"\ntoken = \"secret\"\n");
  CHECK(weak.Says("token must consist of 16..200"));
  CHECK_FALSE(weak.Says("secret"));
  const ReadPage percent("token = \"0123456789%41abcdef\"\n");
  CHECK(percent.Says("token must not contain %"));
  CHECK_FALSE(percent.Says("%41"));
}

TEST_CASE("a weak token is a warning that keeps the page from other computers") {
  const auto with = [](const std::string& token, const std::string& listen = "0.0.0.0") {
    return ReadPage("listen = \"" + listen + "\"\ntoken = \"" + token + "\"\n");
  };
  for (const char* const token :
       {"0123456789abcdef", "9f86d081884c7d659a2feaa0c55ad0", "a-long-word-of-your-own",
        "Mm7YkqZ0p2RtVxW9bN4cD", "what-openssl-rand-hex-16-prints",
        "aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa", "0123456789abcdef0123456789abcdef",
        "secretsecretsecretsecret", "abcdefghijklmnopqrstuvwxyz0123456789"}) {
    CAPTURE(token);
    const ReadPage read = with(token);
    CHECK_FALSE(read.faults.HasFaults());  // the daemon reads this file too
    CHECK(read.Says("warning: the page is not served: its token"));
    CHECK(read.Says("openssl rand -hex 16"));
    CHECK_FALSE(read.Says(token));
  }
  for (const char* const token : {"9f86d081884c7d659a2feaa0c55ad015", "Mm7YkqZ0p2RtVxW9bN4cDg"}) {
    CAPTURE(token);
    CHECK(with(token).faults.All().empty());
  }
  CHECK(with("0123456789abcdef", "127.0.0.1").faults.All().empty());
  CHECK(with("a-long-word-of-your-own", "127.0.0.1").faults.All().empty());
}

TEST_CASE("all faults of [page] are reported at once") {
  const ReadPage read("port = 70000\nhosts = [\"a b\", \"fine\"]\nlisen = \"::1\"\n");
  CHECK(read.Says("page.port: 70000"));
  CHECK(read.Says("\"a b\" is not a host name"));
  CHECK_FALSE(read.Says("\"fine\" is"));
  CHECK(read.Says("page.lisen: unknown key"));
}

}  // namespace plumbline::page_reader_test
