#include <catch2/catch.hpp>

#include "app/base/config/page_config.h"
#include "app/base/config/page_token.h"
#include "app/base/config/toml_reader.h"

namespace plumbline::page_reader_test {

using namespace plumbline::config;

namespace {

struct ReadPage {
  FaultList faults;
  PageConfig page;

  explicit ReadPage(const std::string& lines) {
    TomlDocument document("[page]\n" + lines, "/etc/plumbline.toml", faults);
    REQUIRE(document.parsed());
    page = PageFromToml(*document.Root().RequiredTable("page"));
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
        "secretsecretsecretsecret", "abcdefghijklmnopqrstuvwxyz0123456789",
        "correct-horse-battery-staple-42", "plumblineplumblinecell7hall3", "Mm7YkqZ0p2RtVxW9bN4cDg",
        "deadbeefcafebabedeadc0defeedface", "00112233445566778899aabbccddeeff",
        "a1b2c3d4e5f6a7b8c9d0e1f2a3b4c5d6", "20240131202402282024033120240430",
        "9f86d081884c7d659f86d081884c7d65"}) {
    CAPTURE(token);
    const ReadPage read = with(token);
    CHECK_FALSE(read.faults.HasFaults());  // the daemon reads this file too
    CHECK(read.Says("warning: the page is not served: its token"));
    CHECK(read.Says("plumbline token"));
    CHECK_FALSE(read.Says(token));
  }
  for (const char* const token :
       {"9f86d081884c7d659a2feaa0c55ad015", "9F86D081884C7D659A2FEAA0C55AD015"}) {
    CAPTURE(token);
    CHECK(with(token).faults.All().empty());
  }
  CHECK(with("0123456789abcdef", "127.0.0.1").faults.All().empty());
  CHECK(with("a-long-word-of-your-own", "127.0.0.1").faults.All().empty());
}

TEST_CASE("a generated token is accepted, and is another one each time") {
  const std::string first = GeneratedToken();
  int refused = 0;
  for (int k = 0; k < 20'000; ++k) {
    const std::string token = GeneratedToken();
    CHECK(token.size() == 32);
    CHECK(token != first);
    refused += WhyTokenWeak(token) ? 1 : 0;
  }
  CHECK(refused <= 1);
}

TEST_CASE("all faults of [page] are reported at once") {
  const ReadPage read("port = 70000\nhosts = [\"a b\", \"fine\"]\nlisen = \"::1\"\n");
  CHECK(read.Says("page.port: 70000"));
  CHECK(read.Says("\"a b\" is not a host name"));
  CHECK_FALSE(read.Says("\"fine\" is"));
  CHECK(read.Says("page.lisen: unknown key"));
}

TEST_CASE("the address of the page for other computers") {
  const auto url = [](const char* listen, std::optional<int> port,
                      std::vector<std::string> hosts = {}) {
    return PageUrl({listen, port, "", std::move(hosts)}, "cell7");
  };
  CHECK(url("0.0.0.0", 8080) == "http://cell7:8080/");
  CHECK(url("0.0.0.0", 8080, {"cell7.plant.example"}) == "http://cell7.plant.example:8080/");
  CHECK(url("10.0.0.7", 8080) == "http://10.0.0.7:8080/");
  CHECK(url("fd00::7", 80) == "http://[fd00::7]:80/");
  CHECK(url("127.0.0.1", 8080).empty());
  CHECK(url("0.0.0.0", 0).empty());
  CHECK(url("0.0.0.0", std::nullopt).empty());
}

}  // namespace plumbline::page_reader_test
