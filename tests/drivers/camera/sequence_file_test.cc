#include "drivers/camera/sequence_file.h"

#include <catch2/catch.hpp>

namespace plumbline::sequence_file_test {

using namespace plumbline::camera;

TEST_CASE("sequence file: times and names, an empty name where the camera was lost") {
  const auto frames = SequenceFromCsv("t_s,file\r\n0, a, b.png \r\n\r\n0.05,\n1e-1,sub/c.png");
  REQUIRE(frames);
  REQUIRE(frames->size() == 3);
  CHECK((*frames)[0].file == "a, b.png");
  CHECK((*frames)[1].t_s == 0.05);
  CHECK((*frames)[1].file.empty());
  CHECK((*frames)[2].t_s == 0.1);
  CHECK((*frames)[2].file == "sub/c.png");
}

TEST_CASE("sequence file: faults are reported with their line") {
  const auto fault = [](std::string_view csv) { return SequenceFromCsv(csv).error(); };
  CHECK(fault("") == "line 1: the header is not t_s,file");
  CHECK(fault("file,t_s\na,0") == "line 1: the header is not t_s,file");
  CHECK(fault("t_s,file\n\n") == "contains no frames");
  CHECK(fault("t_s,file\n0 a.png") == "line 2: does not start with a time and a comma");
  CHECK(fault("t_s,file\nnan,a.png") == "line 2: does not start with a time and a comma");
  CHECK(fault("t_s,file\n0,a.png\n\n0,b.png") == "line 4: the time must increase from row to row");
  CHECK(fault(std::string_view("t_s,file\n0,a\0b", 14)) ==
        "line 2: the file name contains a zero byte");
}

}  // namespace plumbline::sequence_file_test
