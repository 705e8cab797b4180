// A lens of the product as the independent camera model of the lens captures.
#pragma once

#include <algorithm>
#include <iterator>

#include "firmware-like/lens/lens.h"
#include "tests/lens_captures/camera_model.h"

namespace plumbline::test {

inline lens_captures::CameraModel StatedCamera(const lens::Lens& l) {
  lens_captures::CameraModel camera;
  camera.fx = l.fx, camera.fy = l.fy, camera.cx = l.cx, camera.cy = l.cy;
  camera.fisheye = l.fisheye;
  const double k[] = {l.k1, l.k2, l.k3, l.k4, l.k5, l.k6}, s[] = {l.s1, l.s2, l.s3, l.s4};
  std::copy(std::begin(k), std::end(k), camera.k);
  std::copy(std::begin(s), std::end(s), camera.s);
  camera.p[0] = l.p1, camera.p[1] = l.p2;
  return camera;
}

}  // namespace plumbline::test
