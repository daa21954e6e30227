// What shows noise and flashes white for `tubectl latency --glass`.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

namespace tubed {

/// One thread. What is shown is a picture that never comes twice, or all white.
class TestScreen {
 public:
  virtual ~TestScreen() = default;
  TestScreen() = default;
  TestScreen(const TestScreen&) = delete;
  TestScreen& operator=(const TestScreen&) = delete;

  /// Shows the next picture, white or noise. CLOCK_MONOTONIC when it was handed to whatever shows it, ns.
  virtual std::int64_t show(bool is_white) = 0;
};

/// This terminal, whose monitor the fluoroscope's capture card has to see. Its screen is given back at the
/// end. Throws std::runtime_error where standard output is no terminal.
std::unique_ptr<TestScreen> terminal_screen();

/// No screen and no card: a grabber of its own, at that socket, whose pictures of width x height are stamped
/// as they are made. What the software alone takes. Throws ShmError.
std::unique_ptr<TestScreen> grabber_screen(const std::string& socket, const std::string& camera, int width,
                                           int height);

}  // namespace tubed
