#include "app/vision/lens_files/lens_files.h"

#include <bit>
#include <catch2/catch.hpp>
#include <opencv2/core.hpp>
#include <random>

#include "app/vision/lens_files/artoolkit_file.h"

namespace plumbline::lens_files_test {

using namespace plumbline::vision;

namespace {

vision::LensEntry Entry() {
  vision::LensEntry entry;
  entry.key = {"SN 1", "GREY", 0x1606, -5};
  entry.lens = {1700, 1701.1234567890123, 959.5, 540, -1.0 / 3, 0.05, 1e-17, -2e-5, 0.125};
  for (int i = 0; i < lens::kUsualParameters; ++i) {
    for (int k = 0; k < lens::kUsualParameters; ++k) {
      entry.covariance(i, k) = 1.0 / (i + k + 1);
    }
  }
  entry.size = {1920, 1080};
  entry.rms_px = 0.1;
  return entry;
}

void CheckSameLens(const lens::Lens& a, const lens::Lens& b) {
  CHECK(a.fx == b.fx);
  CHECK(a.fy == b.fy);
  CHECK(a.cx == b.cx);
  CHECK(a.cy == b.cy);
  CHECK(a.k1 == b.k1);
  CHECK(a.k2 == b.k2);
  CHECK(a.p1 == b.p1);
  CHECK(a.p2 == b.p2);
  CHECK(a.k3 == b.k3);
}

/// A file as OpenCV's calibration sample writes it.
std::string WrittenByOpenCv(const char* name, const char* camera_key, const char* size_key,
                            const cv::Mat& distortion) {
  cv::FileStorage file(name, cv::FileStorage::WRITE | cv::FileStorage::MEMORY);
  file << "calibration_Time"
       << "Thu Nov 26 10:00:00 2026";
  file << (std::string(size_key) + "_width") << 640 << (std::string(size_key) + "_height") << 480;
  const cv::Mat camera = (cv::Mat_<double>(3, 3) << 711.5, 0, 320.25, 0, 713.5, 240, 0, 0, 1);
  file << camera_key << camera << "Distortion_Coefficients" << distortion;
  return file.releaseAndGetString();
}

std::string FaultOf(const std::string& bytes) {
  const auto read = LensFromFile(bytes);
  REQUIRE_FALSE(read.ok());
  return read.error();
}

std::string Replaced(std::string text, const std::string& what, const std::string& by) {
  const std::size_t at = text.find(what);
  REQUIRE(at != std::string::npos);
  return text.replace(at, what.size(), by);
}

/// ARToolKit's file put together byte by byte, independently of the writer.
std::string ArToolKitFile(int width, int height, const std::vector<double>& numbers) {
  std::string bytes;
  const auto put = [&bytes](const void* value, std::size_t size) {
    const auto* const start = static_cast<const char*>(value);
    for (std::size_t k = size; k-- > 0;) bytes += start[k];  // the test runs on little-endian
  };
  put(&width, 4);
  put(&height, 4);
  for (int k = 0; k < 12; ++k) put(&numbers[0], 8);
  for (const double number : numbers) put(&number, 8);
  return bytes;
}

}  // namespace

TEST_CASE("a lens survives XML and YAML with its covariance, and .dat without it") {
  for (const char* name : {"lens.xml", "lens.yaml", "lens.yml", "lens.dat"}) {
    CAPTURE(name);
    const auto written = LensFileOf(Entry(), name);
    REQUIRE(written.ok());
    const auto read = LensFromFile(*written);
    REQUIRE(read.ok());
    CheckSameLens(read->lens, Entry().lens);
    CHECK(read->size == Entry().size);
    CHECK(read->accepted);
    const bool dat = std::string(name).ends_with(".dat");
    CHECK((dat ? read->covariance.isZero(0) : read->covariance == Entry().covariance));
  }
  CHECK_THAT(LensFileOf(Entry(), "lens.txt").error(), Catch::Contains(".xml"));
}

TEST_CASE("files that OpenCV writes are read, with four or five coefficients") {
  const cv::Mat five = (cv::Mat_<double>(5, 1) << -0.25, 0.0625, 1e-3, -1e-4, 0.5);
  const cv::Mat four = (cv::Mat_<double>(1, 4) << -0.25, 0.0625, 1e-3, -1e-4);
  for (const char* name : {"lens.xml", "lens.yml"}) {
    CAPTURE(name);
    const auto read = LensFromFile(WrittenByOpenCv(name, "camera_matrix", "image", five));
    REQUIRE(read.ok());
    CheckSameLens(read->lens, {711.5, 713.5, 320.25, 240, -0.25, 0.0625, 1e-3, -1e-4, 0.5});
    CHECK(read->size == image::ImageSize{640, 480});
    const auto old = LensFromFile(WrittenByOpenCv(name, "Camera_Matrix", "image", four));
    REQUIRE(old.ok());
    CheckSameLens(old->lens, {711.5, 713.5, 320.25, 240, -0.25, 0.0625, 1e-3, -1e-4, 0});
  }
}

TEST_CASE("camera_info of ROS is read") {
  const auto read = LensFromFile(
      "image_width: 640\nimage_height: 480\ncamera_name: side\n"
      "camera_matrix:\n  rows: 3\n  cols: 3\n  data: [711.5, 0, 320.25, 0, 713.5, 240, 0, 0, 1]\n"
      "distortion_model: plumb_bob\n"
      "distortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [-0.25, 0.0625, 0.001, -0.0001, "
      "0]\n");
  REQUIRE(read.ok());
  CheckSameLens(read->lens, {711.5, 713.5, 320.25, 240, -0.25, 0.0625, 1e-3, -1e-4, 0});
}

TEST_CASE("every model and the usable region return from the files that are written") {
  vision::LensEntry entry = Entry();
  entry.usable_radius_px = 512.5;
  for (int model = 0; model < 3; ++model) {
    CAPTURE(model);
    lens::Lens& lens = entry.lens;
    lens.k4 = 0.011, lens.k5 = -0.02, lens.k6 = 0.003;
    if (model == 1) lens.s1 = 1e-4, lens.s2 = 2e-4, lens.s3 = -1e-4, lens.s4 = 3e-4;
    if (model == 2)
      lens = {lens.fx, lens.fy, lens.cx, lens.cy, 0.1, -0.02, 0, 0,   0.003,
              1e-4,    0,       0,       0,       0,   0,     0, true};
    for (const char* name : {"lens.xml", "lens.yaml"}) {
      const auto text = LensFileOf(entry, name);
      REQUIRE(text.ok());
      const auto read = LensFromFile(*text);
      INFO((read ? "" : read.error()));
      REQUIRE(read.ok());
      CHECK(lens::VectorOfLens(read->lens).isApprox(lens::VectorOfLens(lens), 1e-12));
      CHECK(read->lens.fisheye == lens.fisheye);
      CHECK(read->usable_radius_px == Approx(512.5));
    }
    const auto dat = LensFileOf(entry, "lens.dat");
    REQUIRE_FALSE(dat.ok());  // a region, or a fisheye
    if (model == 2) continue;
    entry.usable_radius_px = std::numeric_limits<double>::infinity();
    const auto back = LensFromFile(*LensFileOf(entry, "lens.dat"));
    REQUIRE(back.ok());
    CHECK(lens::VectorOfLens(back->lens).isApprox(lens::VectorOfLens(lens), 1e-12));
    entry.usable_radius_px = 512.5;
  }
}

TEST_CASE("the word of a ROS file decides the model") {
  const auto of = [](const char* word) {
    return LensFromFile(
        std::string(
            "image_width: 640\nimage_height: 480\ncamera_matrix:\n  rows: 3\n  cols: 3\n  data: "
            "[711.5, 0, 320.25, 0, 713.5, 240, 0, 0, 1]\ndistortion_model: ") +
        word +
        "\ndistortion_coefficients:\n  rows: 1\n  cols: 4\n  data: [0.1, 0.02, 0.001, -0.0001]\n");
  };
  const auto fisheye = of("equidistant");
  REQUIRE(fisheye.ok());
  CHECK(fisheye->lens.fisheye);
  CHECK(fisheye->lens.k4 == -0.0001);
  CHECK(of("plumb_bob")->lens.p2 == -0.0001);
  CHECK_THAT(of("kannala_brandt").error(), Catch::Contains("kannala_brandt"));
}

TEST_CASE("camera_para.dat of ARToolKit 4 and 5 is read, older ones are refused") {
  const auto four = LensFromFile(
      ArToolKitFile(640, 480, {-0.25, 0.0625, 1e-3, -1e-4, 711.5, 713.5, 320.25, 240, 1.01}));
  REQUIRE(four.ok());
  CHECK(four->size == image::ImageSize{640, 480});
  CheckSameLens(four->lens, {711.5, 713.5, 320.25, 240, -0.25, 0.0625, 1e-3, -1e-4, 0});
  std::vector<double> factors = {-0.25, 0.0625, 1e-3, -1e-4, 0.5,   0,      0,   0, 0,
                                 0,     0,      0,    711.5, 713.5, 320.25, 240, 1};
  const auto five = LensFromFile(ArToolKitFile(640, 480, factors));
  REQUIRE(five.ok());
  CheckSameLens(five->lens, {711.5, 713.5, 320.25, 240, -0.25, 0.0625, 1e-3, -1e-4, 0.5});
  factors[6] = 0.01;
  const auto rational = LensFromFile(ArToolKitFile(640, 480, factors));
  REQUIRE(rational.ok());
  CHECK(rational->lens.k5 == 0.01);
  CHECK_THAT(FaultOf(ArToolKitFile(640, 480, {318.5, 263.5, 26.2, 1.01})),
             Catch::Contains("ARToolKit 1 to 3"));
  CHECK_THAT(FaultOf(ArToolKitFile(640, 0, std::vector<double>(9, 1.0))),
             Catch::Contains("640 x 0"));
}

TEST_CASE("a fault names the key and what to do") {
  const std::string xml = *LensFileOf(Entry(), "lens.xml");
  CHECK_THAT(FaultOf(Replaced(xml, "<image_width>1920", "<image_width>0")),
             Catch::Contains("image_width"));
  CHECK_THAT(FaultOf(Replaced(xml, "<camera_matrix", "<camera")), Catch::Contains("line 1"));
  CHECK_THAT(
      FaultOf(Replaced(Replaced(xml, "<camera_matrix", "<camera"), "</camera_matrix", "</camera")),
      Catch::Contains("camera_matrix"));
  CHECK_THAT(FaultOf(Replaced(xml, "1700.", "-1700.")), Catch::Contains("positive focal lengths"));
  const cv::Mat tilted =
      (cv::Mat_<double>(14, 1) << -0.25, 0.0625, 0, 0, 0.5, 0, 0, 0, 0, 0, 0, 0, 0.1, 0);
  CHECK_THAT(FaultOf(WrittenByOpenCv("lens.xml", "camera_matrix", "image", tilted)),
             Catch::Contains("without tilt"));
  CHECK_THAT(FaultOf("<!DOCTYPE a [<!ENTITY b \"c\">]><a/>"),
             Catch::Contains("document type declaration"));
  CHECK_THAT(FaultOf("fx: [1, 2"), Catch::Contains("YAML"));
  CHECK_THAT(FaultOf(""), Catch::Contains("calibrate-lens"));
  const auto refused = LensFromFile(
      Replaced(xml, "<opencv_storage>\n", "<opencv_storage>\n<accepted>0</accepted>\n"));
  REQUIRE(refused.ok());
  CHECK_FALSE(refused->accepted);
}

TEST_CASE("damaged files are refused, or read as a sound lens that survives being written") {
  std::mt19937 random(1);
  int sound = 0;
  for (const char* name : {"lens.xml", "lens.yaml", "lens.dat"}) {
    const std::string good = *LensFileOf(Entry(), name);
    for (int k = 0; k < 1500; ++k) {
      std::string bytes = good;
      for (int change = 0; change <= k % 3; ++change) {
        const auto at = std::uniform_int_distribution<std::size_t>(0, bytes.size() - 1)(random);
        bytes[at] = static_cast<char>(std::uniform_int_distribution(0, 255)(random));
      }
      const auto read = LensFromFile(bytes);
      if (!read) {
        CHECK_FALSE(read.error().empty());
        continue;
      }
      ++sound;
      CHECK(read->lens.fx > 0);
      CHECK(read->size.width >= 1);
      vision::LensEntry entry;
      static_cast<lens::KnownLens&>(entry) = *read;
      const auto again = LensFromFile(*LensFileOf(entry, name));
      REQUIRE(again.ok());
      CheckSameLens(again->lens, read->lens);
    }
  }
  CHECK(sound > 100);
}

}  // namespace plumbline::lens_files_test
