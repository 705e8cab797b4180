#include "app/base/recognition/scans.h"

#include <catch2/catch.hpp>

namespace plumbline::scans_test {

using namespace plumbline::recognition;

namespace {

/// "path=value@line" of every entry.
std::vector<std::string> Texts(const Scan& scan) {
  std::vector<std::string> texts;
  for (const Entry& entry : scan.entries) {
    texts.push_back(entry.path + "=" + std::string(entry.value) + "@" + std::to_string(entry.line));
  }
  return texts;
}

using List = std::vector<std::string>;

}  // namespace

TEST_CASE("XML: elements, attributes and texts with their lines") {
  CHECK(Texts(ScanXml("<?xml version='1.0'?>\n<!-- <no/> -->\n<robot name=\"a\">\n"
                      "  <joint\n   type='b'/>\n  <size> 4 </size>\n</robot>\n")) ==
        List{"robot=@3", "robot@name=a@3", "robot.joint=@4", "robot.joint@type=b@5",
             "robot.size=4@6"});
  CHECK(ScanXml("<a><b>").open_at_end == "<b>");
  CHECK(ScanXml("<a><b x=\"1").open_at_end == "the tag <b");
  CHECK(ScanXml("<a/>").open_at_end.empty());
}

TEST_CASE("JSON and what resembles it: lists of numbers are one value") {
  CHECK(Texts(ScanBraces(
            "{\"a\": {\"b\": [1,\n 2]},\n 'c': 'x', \"d\": [{\"e\": 3}, {\"e\": 4}]}")) ==
        List{"a.b=[1,\n 2]@1", "c=x@3", "d.e=3@3", "d.e=4@3"});
  const Scan scan =
      ScanBraces("# comment {\n{ 'lensmodel': 'L', # why\n 'n': [ [1,2], [3,4] ] } rest");
  CHECK(scan.open_at_end.empty());
  CHECK(ScanBraces("{\"a\": [1, 2").open_at_end == "the \"{\" of line 1");
}

TEST_CASE("YAML: nested keys, block and flow lists, documents") {
  CHECK(Texts(ScanYaml(
            "%YAML:1.0\n---\na:\n   rows: 3\n   data: [ 1., 2.,\n       3. ]\nb: \"x y\" # no\n"
            "c:\n- 1\n- 2\nd:\n  - e: 5\n    f: 6\n")) ==
        List{"a=@3", "a.rows=3@4", "a.data=[ 1., 2.,\n       3. ]@5", "b=x y@7", "c=@8", "c=1@9",
             "c=2@10", "d=@11", "d.e=5@12", "d.f=6@13"});
  CHECK(Texts(ScanYaml("m: !!opencv-matrix\n  cols: 1\n")) == List{"m=@1", "m.cols=1@2"});
}

TEST_CASE("TOML: headers, dotted keys, inline tables and long texts") {
  CHECK(Texts(ScanToml("schema = 1 # no\n[robot]\nname = \"a # b\"\n[[robot.joint]]\na_mm = 2\n"
                       "on = { frame = \"world\" }\nlong = '''\n[no]\n'''\nlast = [1,\n2]\n")) ==
        List{"schema=1@1", "robot=[robot]@2", "robot.name=a # b@3", "robot.joint=[[robot.joint]]@4",
             "robot.joint.a_mm=2@5", "robot.joint.on.frame=world@6", "robot.joint.long='''@7",
             "robot.joint.last=[1,\n2]@10"});
}

TEST_CASE("nesting and size are bounded") {
  const std::string deep(100'000, '[');
  CHECK(ScanBraces(deep).entries.size() <= 32);
  std::string tags;
  for (int k = 0; k < 100'000; ++k) tags += "<a>";
  CHECK(ScanXml(tags).entries.size() <= 32);
  std::string keys;
  for (int k = 0; k < 30'000; ++k) keys += "k: 1\n";
  CHECK(ScanYaml(keys).entries.size() == Outline::kMostEntries);
}

}  // namespace plumbline::scans_test
