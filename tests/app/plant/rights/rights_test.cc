#include "app/plant/rights/rights.h"

#include <catch2/catch.hpp>
#include <cstdlib>

#include "tests/app/temporary_folder.h"
#include "tests/file_text.h"

namespace plumbline::rights_test {

using namespace plumbline::plant;

TEST_CASE("a cell is named as its topics name it") {
  const auto cell = CellUserFrom("hall 3/cell-7");
  REQUIRE(cell);
  CHECK(cell->group == "hall 3");
  CHECK(cell->node == "cell-7");
  CHECK(UserOf(*cell) == "hall 3/cell-7");
  CHECK(CellUserFrom("Halle Süd/Zelle_7.b"));
  for (const char* wrong : {"", "cell-7", "/cell-7", "hall/", "hall/a/b", "hall/+", "#/a", "a:b/c",
                            "hall/a\nuser x", "hall/ a", "a /b", "hall/a\x7f"}) {
    INFO(wrong);
    CHECK_FALSE(CellUserFrom(wrong));
  }
  CHECK_FALSE(CellUserFrom("hall/" + std::string(65, 'x')));
  CHECK(CellUserFrom("hall/" + std::string(64, 'x')));
  CHECK_THAT(CellUserFrom("cell-7").error(), Catch::Contains("is not GROUP/NODE"));
  CHECK(CheckGroup("line-3"));
  CHECK_FALSE(CheckGroup("line/3"));
}

TEST_CASE("the access list lets each cell write its own topics only") {
  CHECK(AclText({{"line-3", "b"}, {"line-3", "a"}}, {"line-4"}) ==
        "# Written by plumbline from the users of the password file beside it; changes are lost.\n"
        "# Each cell writes its own topics, and nobody reads.\n"
        "\nuser line-3/a\ntopic write plumblineV1/line-3/+/a\n"
        "\nuser line-3/b\ntopic write plumblineV1/line-3/+/b\n"
        "\nuser bridge-line-4\ntopic write plumblineV1/line-4/+/+\n");
}

TEST_CASE("a password line is the one that mosquitto_passwd writes") {
  // mosquitto_passwd 2.0.11
  const std::string salt = "\x01\x02\x03\x04\x05\x06\x07\x08\x09\x0a\x0b\x0c";
  const auto line = PasswordLine("hall/a", "right", salt, 101);
  REQUIRE(line);
  CHECK_THAT(*line, Catch::StartsWith("hall/a:$7$101$AQIDBAUGBwgJCgsM$"));
  CHECK(line->size() == std::string("hall/a:$7$101$AQIDBAUGBwgJCgsM$").size() + 88);
  CHECK(*PasswordLine("a", "b") != *PasswordLine("a", "b"));  // another salt
}

TEST_CASE("mosquitto_passwd with the same salt gives the same line") {
  const test::TemporaryFolder folder;
  const std::string file = folder.path() + "/users";
  if (std::system(("mosquitto_passwd -b -c " + file + " cell right >/dev/null 2>&1").c_str()) !=
      0) {
    WARN("SKIPPED: no mosquitto_passwd here");
    return;
  }
  std::string theirs = test::FileText(file);
  theirs.pop_back();  // the newline
  const auto fields = [&theirs](int number) {
    std::size_t begin = 0;
    for (int k = 0; k < number; ++k) begin = theirs.find('$', begin) + 1;
    return theirs.substr(begin, theirs.find('$', begin) - begin);
  };
  REQUIRE(fields(1) == "7");
  // base64 of twelve bytes has no padding
  std::string salt;
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  unsigned bits = 0;
  int count = 0;
  for (const char c : fields(3)) {
    bits = bits << 6 | static_cast<unsigned>(digits.find(c));
    if (++count % 4 != 0) continue;
    for (const int shift : {16, 8, 0}) salt += static_cast<char>(bits >> shift & 0xFFU);
    bits = 0;
  }
  CHECK(*PasswordLine("cell", "right", salt, std::stoi(fields(2))) == theirs);
}

TEST_CASE("the password file is the list of cells") {
  std::string file = "legacy:$7$1$a$b\n\nbridge-line-4:$7$1$a$b\nline-3/a:$7$1$old$b";
  file = WithPasswordLine(file, "line-3/a:$7$1$new$b");
  file = WithPasswordLine(file, "line-3/b:$7$1$b$b");
  CHECK(file ==
        "legacy:$7$1$a$b\nbridge-line-4:$7$1$a$b\nline-3/a:$7$1$new$b\nline-3/b:$7$1$b$b\n");
  const BrokerUsers users = UsersIn(file);
  CHECK(users.cells == std::vector<CellUser>{{"line-3", "a"}, {"line-3", "b"}});
  CHECK(users.bridged_groups == std::vector<std::string>{"line-4"});
  CHECK(users.others == std::vector<std::string>{"legacy"});
  CHECK(WithoutUser(file, "line-3/a") ==
        "legacy:$7$1$a$b\nbridge-line-4:$7$1$a$b\nline-3/b:$7$1$b$b\n");
  CHECK(UsersIn("").cells.empty());
}

}  // namespace plumbline::rights_test
