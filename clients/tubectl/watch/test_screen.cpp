#include "clients/tubectl/watch/test_screen.hpp"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <random>
#include <stdexcept>
#include <vector>

#include "clients/cpp/shm_image_writer.hpp"
#include "drivers/interface/monotonic_clock.hpp"

namespace tubed {

namespace {

constexpr int kDarkest = 40;  // grey levels of the noise
constexpr int kBrightest = 150;

class TerminalScreen final : public TestScreen {
 public:
  TerminalScreen() {
    if (isatty(STDOUT_FILENO) != 1 || ioctl(STDOUT_FILENO, TIOCGWINSZ, &size_) != 0 || size_.ws_col == 0) {
      throw std::runtime_error("--glass terminal: standard output is no terminal whose size is known");
    }
    write_all("\x1b[?1049h\x1b[?25l");  // a screen of its own, no cursor
  }
  ~TerminalScreen() override { write_all("\x1b[0m\x1b[?25h\x1b[?1049l"); }

  std::int64_t show(bool is_white) override {
    std::string text = "\x1b[H";
    for (int row = 0; row < size_.ws_row; ++row) {
      for (int column = 0; column < size_.ws_col; ++column) {
        const int grey = is_white ? 255 : level_(random_);
        if (!is_white || column == 0) {
          const std::string level = std::to_string(grey);
          text += "\x1b[48;2;" + level + ";" + level + ";" + level + "m";
        }
        text += ' ';
      }
      text += row + 1 < size_.ws_row ? "\r\n" : "";
    }
    write_all(text);
    return to_ns(monotonic_now());
  }

 private:
  static void write_all(const std::string& text) {
    for (std::size_t done = 0; done < text.size();) {
      const ssize_t written = ::write(STDOUT_FILENO, text.data() + done, text.size() - done);
      if (written <= 0) return;
      done += static_cast<std::size_t>(written);
    }
  }

  winsize size_{};
  std::minstd_rand random_{1};
  std::uniform_int_distribution<int> level_{kDarkest, kBrightest};
};

class GrabberScreen final : public TestScreen {
 public:
  GrabberScreen(const std::string& socket, const std::string& camera, int width, int height)
      : width_(static_cast<std::uint32_t>(width)),
        height_(static_cast<std::uint32_t>(height)),
        pixels_(std::size_t{width_} * height_),
        writer_({.socket = socket,
                 .camera = camera,
                 .max_width = width_,
                 .max_height = height_,
                 .max_depth_bits = 16,
                 .group = {}}) {}

  std::int64_t show(bool is_white) override {
    if (is_white) {
      std::fill(pixels_.begin(), pixels_.end(), std::uint8_t{255});
    } else {
      std::generate(pixels_.begin(), pixels_.end(), [this] {
        return static_cast<std::uint8_t>(kDarkest +
                                         static_cast<int>(random_() >> 8U) % (kBrightest - kDarkest));
      });
    }
    tubed_shm_image image{};
    image.exposure_ns = to_ns(monotonic_now());
    image.frame_number = ++number_;
    image.origin = TUBED_SHM_SIMULATED;
    image.fluoroscopy_on = 1;
    image.depth_bits = 8;
    image.width = width_;
    image.height = height_;
    writer_.put(image, pixels_.data());
    return image.exposure_ns;
  }

 private:
  std::uint32_t width_, height_;
  std::vector<std::uint8_t> pixels_;
  std::minstd_rand random_{1};
  std::uint32_t number_ = 0;
  ShmImageWriter writer_;
};

}  // namespace

std::unique_ptr<TestScreen> terminal_screen() { return std::make_unique<TerminalScreen>(); }

std::unique_ptr<TestScreen> grabber_screen(const std::string& socket, const std::string& camera, int width,
                                           int height) {
  return std::make_unique<GrabberScreen>(socket, camera, width, height);
}

}  // namespace tubed
