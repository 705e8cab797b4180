// Camera error formulas of the model against poses solved by OpenCV from a projection with the true
// camera.
#include <catch2/catch.hpp>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <random>

#include "firmware-like/deflection/equations.h"
#include "firmware-like/geometry/rotation.h"

namespace plumbline::camera_reading_test {

using namespace plumbline::deflection;
using I = effects::Influence<double>;

namespace {

constexpr double kFocal = 2000;

cv::Mat Camera(double focal_px) {
  return (cv::Mat_<double>(3, 3) << focal_px, 0, 960, 0, focal_px, 540, 0, 0, 1);
}

/// Position of a body reported by a camera that assumes `assumed` but has the lens `focal_px`,
/// `k1`. The body: corners of a cube of 80 mm, small compared with its distance of 1 to 3 m;
/// actually `size` times as large.
Vec3 Solved(const Vec3& p_C, const Mat3& R_CM, double focal_px, double k1, double size) {
  std::vector<cv::Point3d> assumed, real_C;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 p_M(corner & 1 ? 0.04 : -0.04, corner & 2 ? 0.04 : -0.04, corner & 4 ? 0.04 : -0.04);
    const Vec3 q = p_C + R_CM * (size * p_M);
    assumed.emplace_back(p_M.x(), p_M.y(), p_M.z());
    real_C.emplace_back(q.x(), q.y(), q.z());
  }
  std::vector<cv::Point2d> image;
  const cv::Vec3d nothing(0, 0, 0);
  cv::projectPoints(real_C, nothing, nothing, Camera(focal_px), cv::Vec4d(k1, 0, 0, 0), image);
  cv::Mat turn, place;
  const Vec3 v = VectorFromRotation(R_CM);
  turn = (cv::Mat_<double>(3, 1) << v.x(), v.y(), v.z());
  place = (cv::Mat_<double>(3, 1) << p_C.x(), p_C.y(), p_C.z());
  REQUIRE(cv::solvePnP(assumed, image, Camera(kFocal), cv::noArray(), turn, place, true));
  return {place.at<double>(0), place.at<double>(1), place.at<double>(2)};
}

struct Wrong {
  const char* what;
  I::Entry entry;
  double value;               ///< value of the model parameter
  double focal_px, k1, size;  ///< of the true camera and tags
  double nearly;              ///< tolerance, as a share of the RMS displacement
};

}  // namespace

TEST_CASE("a camera with errors reports a body where the model predicts") {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> draw(-1, 1);
  const Pose X_WC{RotationFromRollPitchYaw(Vec3(0.4, -0.2, 1.0)), Vec3(1, -2, 0.5)};
  for (const Wrong& wrong :
       {Wrong{"tags 2 % smaller than configured", I::kCameraScale, 1 / 0.98 - 1, kFocal, 0, 0.98,
              1e-6},
        Wrong{"zoomed in by 1 %", I::kCameraDepth, 1 / 1.01 - 1, 1.01 * kFocal, 0, 1, 0.03},
        Wrong{"zoomed out by 3 %", I::kCameraDepth, 1 / 0.97 - 1, 0.97 * kFocal, 0, 1, 0.03},
        Wrong{"k1 of 0.01", I::kCameraRadial, 0.01, kFocal, 0.01, 1, 0.1}}) {
    CAPTURE(wrong.what);
    double off = 0, all = 0;
    for (int trial = 0; trial < 200; ++trial) {
      const double Z = 2 + draw(random);
      const Vec3 p_C(0.3 * Z * draw(random), 0.2 * Z * draw(random), Z);
      const Mat3 R_CM = RotationFromVector(2 * Vec3(draw(random), draw(random), draw(random)));
      const Vec3 real_W = X_WC * p_C;
      const Vec3 read_W = X_WC * Solved(p_C, R_CM, wrong.focal_px, wrong.k1, wrong.size);
      I influence;
      influence[wrong.entry] = wrong.value;
      const Vec3 model_W = ReadByCamera<double>(X_WC, influence, real_W);
      off += (model_W - read_W).squaredNorm();
      all += (read_W - real_W).squaredNorm();
    }
    CAPTURE(std::sqrt(all / 200), std::sqrt(off / all));
    CHECK(std::sqrt(off / all) < wrong.nearly);
  }
}

TEST_CASE("a point behind the camera is not changed") {
  I influence;
  influence[I::kCameraScale] = 0.1;
  CHECK(ReadByCamera<double>(Pose{}, influence, Vec3(0.1, 0.2, -1)) == Vec3(0.1, 0.2, -1));
}

}  // namespace plumbline::camera_reading_test
