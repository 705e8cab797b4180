// Exported lens files read by OpenCV itself.
#include "app/vision/lens_files/opencv_file.h"

#include <catch2/catch.hpp>
#include <opencv2/core.hpp>

namespace plumbline::opencv_file_test {

using namespace plumbline::vision;

TEST_CASE("OpenCV reads every number bit-exactly, from YAML and from XML") {
  vision::LensEntry entry;
  entry.key = {"SN \"1\" <&> \\", "GREY", 0x1606, -5};
  entry.lens = {1700, 1701.1234567890123, 959.5, 540, -1.0 / 3, 0.05, 1e-17, -2e-5, 1e5 / 3};
  for (int i = 0; i < lens::kLensParameters; ++i) {
    for (int k = 0; k < lens::kLensParameters; ++k)
      entry.covariance(i, k) = 1.0 / (i + k + 1) - 0.5;
  }
  entry.size = {1920, 1080};
  entry.rms_px = 0.1;
  entry.utc = "2026-11-21T07:30:00Z";
  entry.declared = {true, true};
  for (const bool yaml : {true, false}) {
    CAPTURE(yaml);
    const std::string text = yaml ? OpenCvYaml(entry) : OpenCvXml(entry);
    const cv::FileStorage file(text, cv::FileStorage::READ | cv::FileStorage::MEMORY);
    REQUIRE(file.isOpened());
    cv::Mat camera, distortion, covariance;
    file["camera_matrix"] >> camera;
    file["distortion_coefficients"] >> distortion;
    file["parameter_covariance"] >> covariance;
    REQUIRE(camera.type() == CV_64F);
    REQUIRE(camera.size() == cv::Size(3, 3));
    CHECK(camera.at<double>(0, 0) == entry.lens.fx);
    CHECK(camera.at<double>(1, 1) == entry.lens.fy);
    CHECK(camera.at<double>(0, 2) == entry.lens.cx);
    CHECK(camera.at<double>(1, 2) == entry.lens.cy);
    CHECK(camera.at<double>(2, 2) == 1);
    CHECK(camera.at<double>(1, 0) == 0);
    REQUIRE(distortion.size() == cv::Size(1, 5));
    const double expected[] = {entry.lens.k1, entry.lens.k2, entry.lens.p1, entry.lens.p2,
                               entry.lens.k3};
    for (int i = 0; i < 5; ++i) CHECK(distortion.at<double>(i) == expected[i]);
    REQUIRE(covariance.size() == cv::Size(9, 9));
    for (int i = 0; i < 9; ++i) {
      for (int k = 0; k < 9; ++k) CHECK(covariance.at<double>(i, k) == entry.covariance(i, k));
    }
    CHECK(static_cast<int>(file["image_width"]) == 1920);
    CHECK(static_cast<int>(file["image_height"]) == 1080);
    CHECK(static_cast<double>(file["avg_reprojection_error"]) == 0.1);
    CHECK(static_cast<int>(file["zoom_counts"]) == 0x1606);
    CHECK(static_cast<int>(file["focus_counts"]) == -5);
    CHECK(static_cast<std::string>(file["calibration_time"]) == entry.utc);
    CHECK(static_cast<std::string>(file["declared"]) == "no_window, fixed_focus");
    CHECK(static_cast<std::string>(file["camera_serial"]) == entry.key.camera_serial);
  }
}

}  // namespace plumbline::opencv_file_test
