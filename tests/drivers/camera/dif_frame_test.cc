// Block structure of DV frames and streams, and the answers of plumbline-dv.
#include "drivers/camera/dif_frame.h"

#include <catch2/catch.hpp>
#include <cstring>

#include "drivers/camera/dif_stream.h"
#include "drivers/camera/dv_field.h"
#include "tests/drivers/camera/dv_frames.h"

namespace plumbline::dif_frame_test {

using namespace plumbline::camera;
using Bytes = std::vector<std::uint8_t>;
using test::BareDvFrame;

namespace {

std::string FaultOf(const Bytes& frame) {
  const auto format = CheckDifFrame(frame);
  return format ? "" : format.error();
}

void Add(Bytes& to, const Bytes& more, std::size_t size) {
  to.insert(to.end(), more.begin(), more.begin() + static_cast<std::ptrdiff_t>(size));
}

/// Passes the bytes in pieces. @return the frames found
std::vector<Bytes> Frames(DifStream& stream, const Bytes& bytes, std::size_t piece) {
  std::vector<Bytes> frames;
  for (std::size_t at = 0; at < bytes.size(); at += piece) {
    stream.Append(std::span(bytes).subspan(at, std::min(piece, bytes.size() - at)));
    Bytes frame;
    if (stream.TakeNewest(frame) > 0) frames.push_back(frame);
  }
  return frames;
}

}  // namespace

TEST_CASE("dv frame: both line numbers and aspect ratios, with square pixels") {
  CHECK(DifFrameBytes(true) == 144000);
  CHECK(DifFrameBytes(false) == 120000);
  struct Case {
    bool lines_625, wide;
    image::ImageSize size;
    int rows;
    double pixel_aspect;
  };
  for (const Case& one : {Case{true, false, {787, 576}, 288, 59.0 / 54},
                          {true, true, {1049, 576}, 288, 118.0 / 81},
                          {false, false, {655, 480}, 240, 10.0 / 11},
                          {false, true, {873, 480}, 240, 40.0 / 33}}) {
    const auto format = CheckDifFrame(BareDvFrame(one.lines_625, one.wide));
    REQUIRE(format);
    CHECK(*format == DifFormat{one.lines_625, one.wide});
    CHECK(SquareSize(*format) == one.size);
    CHECK(FieldRows(*format) == one.rows);
    // The rounded width keeps the pixels square to 0.1 %, a tenth of what the lens fit expects.
    CHECK(SquareSize(*format).width / 720.0 == Approx(one.pixel_aspect).epsilon(1e-3));
  }
}

TEST_CASE("dv frame: whatever is damaged is refused with its place") {
  const Bytes good = BareDvFrame(true);
  REQUIRE(FaultOf(good).empty());
  Bytes bad = good;
  bad.resize(143920);
  CHECK(FaultOf(bad) == "a DV frame of 143920 bytes instead of 144000");
  bad.resize(144080);
  CHECK(FaultOf(bad) == "a DV frame of 144080 bytes instead of 144000");
  CHECK_THAT(FaultOf({}), Catch::Contains("does not start with a header block"));
  CHECK_THAT(FaultOf(Bytes(120000)), Catch::Contains("a damaged DV frame: block 1 of sequence 0"));
  bad = good;
  bad[3] = 0;  // says 525 lines
  CHECK(FaultOf(bad) == "a DV frame of 144000 bytes instead of 120000");
  bad = good;
  bad[12000 * 7 + 80 * 149 + 2] ^= 1;
  CHECK_THAT(FaultOf(bad), Catch::Contains("block 149 of sequence 7 is identified as 9f 77 87"));
  bad = good;
  bad[12000 * 3 + 80 * 7 + 3] = 0xE0;
  CHECK_THAT(FaultOf(bad),
             Catch::Contains("block 7 of sequence 3 as damaged or concealed (STA e)"));
  bad = good;
  bad[80 * 6 + 3] = 0xF0;  // of audio, which is ignored
  CHECK(FaultOf(bad).empty());
  bad = good;
  bad[1] |= 8;  // the second half of a 50 Mbit/s frame
  CHECK_THAT(FaultOf(bad), Catch::Contains("does not start with a header block"));
}

TEST_CASE("dv stream: frames are found from any start and after lost data") {
  Bytes first = BareDvFrame(true), second = BareDvFrame(false), third = BareDvFrame(true);
  first[500] = 1;
  second[500] = 2;
  third[500] = 3;
  Bytes bytes(1234, 0x1F);
  Add(bytes, first, first.size());
  Add(bytes, second, 70000);  // the rest is lost
  Add(bytes, third, third.size());
  Add(bytes, second, second.size());
  for (const std::size_t piece : {1000U, 65536U, 77777U}) {
    DifStream stream;
    const std::vector<Bytes> frames = Frames(stream, bytes, piece);
    CHECK(frames == std::vector<Bytes>{first, third, second});
    CHECK(stream.damaged() == 1);
    CHECK_THAT(stream.why_damaged(), Catch::Contains("damaged DV frame"));
  }
  DifStream stream;
  stream.Append(bytes);
  Bytes newest;
  CHECK(stream.TakeNewest(newest) == 3);
  CHECK(newest == second);
  CHECK(stream.TakeNewest(newest) == 0);
}

TEST_CASE("dv stream: data without a frame do not accumulate") {
  DifStream stream;
  const Bytes noise(65536, 0x1F);
  Bytes frame;
  for (int k = 0; k < 20; ++k) {
    stream.Append(noise);
    REQUIRE(stream.TakeNewest(frame) == 0);
  }
  stream.Append(BareDvFrame(false));
  CHECK(stream.TakeNewest(frame) == 1);
}

TEST_CASE("dv answer: only the field that the frame announces is accepted") {
  const auto bytes_of = [](std::uint32_t magic, std::uint32_t rows) {
    const DvAnswerHeader header{magic, rows};
    std::array<std::uint8_t, sizeof header> bytes{};
    std::memcpy(bytes.data(), &header, sizeof header);
    return DvAnswerBytes(bytes, {.lines_625 = true});
  };
  constexpr std::uint32_t kMagic = DvAnswerHeader::kMagic;
  CHECK(bytes_of(kMagic, 288) == 414720U);
  CHECK(bytes_of(kMagic, 0) == 0U);
  for (const std::uint32_t rows : {1U, 240U, 289U, 0xFFFFFFFFU}) {
    CHECK_FALSE(bytes_of(kMagic, rows).has_value());
  }
  CHECK_FALSE(bytes_of(kMagic + 1, 288).has_value());
}

}  // namespace plumbline::dif_frame_test
