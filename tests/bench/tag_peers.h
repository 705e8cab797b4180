// Tag detectors that tracking_bench compares with: AprilTag and OpenCV's ArUco.
#pragma once

extern "C" {
#include <apriltag/apriltag.h>
#include <apriltag/tag36h11.h>
}

#include <opencv2/aruco.hpp>
#include <utility>
#include <vector>

#include "app/vision/tracking/tag_detector.h"
#include "tests/app/vision/tracking/tag_scene.h"

namespace plumbline::bench {

/// Tags of an image: number and corners.
using Seen = std::vector<std::pair<int, vision::Corners>>;

/// Both on one core.
struct Peers {
  apriltag_family_t* tags = tag36h11_create();
  apriltag_detector_t* detector = apriltag_detector_create();
  cv::Ptr<cv::aruco::Dictionary> dictionary =
      cv::aruco::getPredefinedDictionary(cv::aruco::DICT_APRILTAG_36h11);
  cv::Ptr<cv::aruco::DetectorParameters> parameters = cv::aruco::DetectorParameters::create();

  explicit Peers(float decimate = 2) {
    apriltag_detector_add_family(detector, tags);
    detector->quad_decimate = decimate;
    detector->nthreads = 1;
    parameters->cornerRefinementMethod = cv::aruco::CORNER_REFINE_SUBPIX;
    cv::setNumThreads(1);
  }

  Seen April(renderer::Image& image) const {
    image_u8_t view{image.width, image.height, image.width, image.grey.data()};
    zarray_t* const found = apriltag_detector_detect(detector, &view);
    Seen seen;
    for (int i = 0; i < zarray_size(found); ++i) {
      apriltag_detection_t* tag = nullptr;
      zarray_get(found, i, &tag);
      vision::Corners
          corners;  // AprilTag: anticlockwise from the bottom left, offset by half a pixel
      for (int c = 0; c < 4; ++c)
        corners[c] = lens::Vec2(tag->p[3 - c][0] - 0.5, tag->p[3 - c][1] - 0.5);
      seen.emplace_back(tag->id, corners);
    }
    apriltag_detections_destroy(found);
    return seen;
  }

  Seen Aruco(renderer::Image& image) const {
    const cv::Mat view(image.height, image.width, CV_8U, image.grey.data());
    std::vector<int> ids;
    std::vector<std::vector<cv::Point2f>> found;
    cv::aruco::detectMarkers(view, dictionary, found, ids, parameters);
    Seen seen;
    for (std::size_t i = 0; i < ids.size(); ++i) {
      vision::Corners corners;  // ArUco: rotated by 180 degrees
      for (int c = 0; c < 4; ++c)
        corners[c] = lens::Vec2(found[i][(c + 2) % 4].x, found[i][(c + 2) % 4].y);
      seen.emplace_back(ids[i], corners);
    }
    return seen;
  }
};

}  // namespace plumbline::bench
