#include "drivers/camera/image_file.h"

#include <dlfcn.h>
#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>

#include "drivers/camera/image_codecs.h"
#include "tests/app/temporary_folder.h"

namespace plumbline::image_file_test {

using namespace plumbline::camera;

namespace {

using Bytes = std::vector<std::uint8_t>;

/// An image whose left half is dark.
cv::Mat Halves() {
  cv::Mat image(48, 64, CV_8U, cv::Scalar(200));
  image.colRange(0, 32) = cv::Scalar(30);
  return image;
}

Bytes Jpeg(const cv::Mat& image, const std::vector<int>& how = {}) {
  Bytes bytes;
  cv::imencode(".jpg", image, bytes, how);
  return bytes;
}

/// Captures everything written to standard error during its lifetime.
class StandardError {
 public:
  explicit StandardError(const std::string& path)
      : file_(open(path.c_str(), O_RDWR | O_CREAT | O_TRUNC, 0600)), kept_(dup(2)) {
    dup2(file_, 2);
  }
  ~StandardError() {
    dup2(kept_, 2);
    close(kept_);
    close(file_);
  }
  StandardError(const StandardError&) = delete;
  StandardError& operator=(const StandardError&) = delete;
  std::string Text() const {
    std::fflush(stderr);
    std::string text(static_cast<std::size_t>(lseek(file_, 0, SEEK_END)), '\0');
    const auto read = pread(file_, text.data(), text.size(), 0);
    text.resize(static_cast<std::size_t>(std::max<ssize_t>(0, read)));
    return text;
  }

 private:
  int file_, kept_;
};

struct Read {
  Result<GreyImage> image;
  std::string printed;
};

Read ReadBytes(const Bytes& bytes) {
  const test::TemporaryFolder folder;
  std::ofstream(folder.path() + "/image.jpg", std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
  const StandardError error(folder.path() + "/stderr");
  Result<GreyImage> image = ReadImage(folder.path() + "/image.jpg");
  return {std::move(image), error.Text()};
}

}  // namespace

TEST_CASE("every kind of JPEG file is read as luma") {
  cv::Mat colour(48, 64, CV_8UC3, cv::Scalar(20, 120, 220));
  const std::vector<Bytes> files = {Jpeg(Halves()), Jpeg(colour),
                                    Jpeg(Halves(), {cv::IMWRITE_JPEG_PROGRESSIVE, 1})};
  for (const Bytes& bytes : files) {
    const Read read = ReadBytes(bytes);
    REQUIRE(read.image);
    CHECK(read.printed.empty());
    CHECK(read.image->width == 64);
    const cv::Mat as_opencv = cv::imdecode(bytes, cv::IMREAD_GRAYSCALE);
    CHECK(std::equal(read.image->grey.begin(), read.image->grey.end(), as_opencv.datastart,
                     as_opencv.dataend));
  }
}

TEST_CASE("faults of a JPEG file are returned and nothing is printed") {
  const Bytes whole = Jpeg(Halves());
  const auto fault = [](const Bytes& bytes) {
    const Read read = ReadBytes(bytes);
    CHECK(read.printed.empty());
    return read.image ? std::string() : read.image.error();
  };
  Bytes torn(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(whole.size()) - 20);
  CHECK_THAT(fault(torn), Catch::StartsWith("a damaged JPEG: "));
  CHECK_THAT(fault({0xFF, 0xD8, 0xFF, 0xD9}), Catch::Contains("JPEG"));
  CHECK_THAT(fault({0xFF, 0xD8}), Catch::Contains("JPEG"));
  CHECK_THAT(fault({'x'}), Catch::Contains("not a readable image"));
  Bytes vast = whole;  // the height and width of its frame header
  const Bytes frame_header = {0xFF, 0xC0};
  const auto at = std::search(vast.begin(), vast.end(), frame_header.begin(), frame_header.end());
  REQUIRE(at != vast.end());
  std::fill(at + 5, at + 9, std::uint8_t{0xF0});
  CHECK_THAT(fault(vast), Catch::Contains("61680 x 61680 px"));
}

TEST_CASE("the size of an image is checked in its header, before it is decoded") {
  std::vector<std::uint8_t> bytes;
  REQUIRE(cv::imencode(".png", Halves(), bytes));
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  REQUIRE(SizeFromPngHeader(text));
  CHECK(SizeFromPngHeader(text)->width == 64);
  CHECK(SizeFromPngHeader(text)->height == 48);
  for (std::size_t size = 0; size < kPngHeaderBytes; ++size) {
    CHECK_FALSE(SizeFromPngHeader(text.substr(0, size)));
  }
  Bytes vast(bytes.begin(), bytes.end());
  for (const std::size_t at : {std::size_t{18}, std::size_t{22}}) {  // 30000 x 30000
    vast[at] = 0x75;
    vast[at + 1] = 0x30;
  }
  const Read read = ReadBytes(vast);
  REQUIRE_FALSE(read.image);
  CHECK(read.image.error() == "a PNG of 30000 x 30000 px; the limit is 100 megapixels");
}

TEST_CASE("extra bytes between JPEG segments are ignored") {
  Bytes bytes = Jpeg(Halves());
  bytes.insert(bytes.end() - 2, {0, 0, 0});
  const Read read = ReadBytes(bytes);
  CHECK(read.image);
  CHECK(read.printed.empty());
}

TEST_CASE("an orientation tag is ignored") {
  Bytes bytes = Jpeg(Halves());
  const Bytes turned = {0xFF, 0xE1, 0, 34,   'E', 'x', 'i', 'f', 0, 0, 'M', 'M', 0, 42, 0, 0, 0, 8,
                        0,    1,    1, 0x12, 0,   3,   0,   0,   0, 1, 0,   6,   0, 0,  0, 0, 0, 0};
  bytes.insert(bytes.begin() + 2, turned.begin(), turned.end());
  CHECK(cv::imdecode(bytes, cv::IMREAD_GRAYSCALE).cols == 48);
  const Read read = ReadBytes(bytes);
  REQUIRE(read.image);
  CHECK(read.image->width == 64);
}

TEST_CASE("every format supported by OpenCV is read as 8-bit luma") {
  cv::Mat deep, colour, deep_colour;
  Halves().convertTo(deep, CV_16U, 257);
  cv::merge(std::vector<cv::Mat>{Halves(), 255 - Halves(), Halves() / 2}, colour);
  colour.convertTo(deep_colour, CV_16U, 257);
  const std::vector<std::pair<std::string, std::vector<cv::Mat>>> kinds = {
      {".png", {Halves(), colour, deep, deep_colour}},
      {".tif", {Halves(), colour, deep, deep_colour}},
      {".bmp", {Halves(), colour}},
      {".pgm", {Halves(), deep}},
      {".ppm", {colour, deep_colour}},
      {".webp", {colour}},
      {".jp2", {Halves(), colour}},
      {".ras", {Halves(), colour}}};
  for (const auto& [ending, images] : kinds) {
    for (const cv::Mat& image : images) {
      CAPTURE(ending, image.type());
      Bytes bytes;
      REQUIRE(cv::imencode(ending, image, bytes));
      const Read read = ReadBytes(bytes);
      REQUIRE(read.image);
      const cv::Mat as_opencv = cv::imdecode(bytes, cv::IMREAD_GRAYSCALE);
      CHECK(read.image->width == 64);
      CHECK(read.image->height == 48);
      CHECK(std::equal(read.image->grey.begin(), read.image->grey.end(), as_opencv.datastart,
                       as_opencv.dataend));
    }
  }
}

TEST_CASE("an unusable codec module is reported with the reason and the remedy") {
  const test::TemporaryFolder folder;
  const std::string module = folder.path() + "/" + kImageCodecsFile;
  const auto refused = [&module] {
    const Result<ImageCodecs> codecs = OpenImageCodecs(module);
    REQUIRE_FALSE(codecs);
    CHECK_THAT(codecs.error(), Catch::Contains(module) &&
                                   Catch::Contains("only JPEG can be read") &&
                                   Catch::Contains("apt install --reinstall plumbline"));
    return codecs.error();
  };
  CHECK_THAT(refused(), Catch::Contains("No such file"));
  std::ofstream(module) << "no library";
  CHECK_THAT(refused(), Catch::Contains("cannot be loaded: "));
  // A module of another version: the library lacks the function.
  std::filesystem::remove(module);
  Dl_info other{};
  REQUIRE(dladdr(dlsym(RTLD_DEFAULT, "jpeg_start_decompress"), &other) != 0);
  std::filesystem::create_symlink(other.dli_fname, module);
  CHECK_THAT(refused(), Catch::Contains("undefined symbol: plumbline_read_grey_image_"));
}

}  // namespace plumbline::image_file_test
