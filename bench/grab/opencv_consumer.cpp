#ifdef TUBED_BENCH_OPENCV_VIDEO
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <stdexcept>

#include "bench/grab/consumers.hpp"

namespace tubed {

/// The cheapest that it offers for grey values: the card's own bytes, Motion JPEG decoded to luma alone.
void read_by_opencv(const CardFormat& format, const OnPicture& on_picture) {
  const std::string& f = format.fourcc;
  cv::VideoCapture capture(format.device, cv::CAP_V4L2);
  capture.set(cv::CAP_PROP_FOURCC, cv::VideoWriter::fourcc(f[0], f[1], f[2], f[3]));
  capture.set(cv::CAP_PROP_FRAME_WIDTH, format.width);
  capture.set(cv::CAP_PROP_FRAME_HEIGHT, format.height);
  capture.set(cv::CAP_PROP_FPS, format.rate_hz);
  capture.set(cv::CAP_PROP_CONVERT_RGB, 0);
  if (!capture.isOpened()) throw std::runtime_error("OpenCV does not open " + format.device);
  cv::Mat raw, grey;
  for (;;) {
    if (!capture.read(raw)) throw std::runtime_error("OpenCV reads no picture");
    if (format.fourcc == "MJPG") {
      cv::imdecode(raw, cv::IMREAD_GRAYSCALE, &grey);
    } else {
      grey = raw;
    }
    if (grey.empty()) throw std::runtime_error("OpenCV decodes no picture");
    if (!on_picture(grey.data, grey.total() * grey.elemSize())) return;
  }
}

}  // namespace tubed
#endif
