// frangi_probe WIDTH HEIGHT SIGMA BETA C float|int16: 8-bit pixels in, vesselness as floats out, row by row.
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <vector>

#include "daemon/image/frangi.hpp"

int main(int argc, char** argv) {
  if (argc != 7) {
    std::fprintf(stderr, "usage: frangi_probe WIDTH HEIGHT SIGMA BETA C float|int16\n");
    return 64;
  }
  tubed::FrangiSettings settings;
  settings.scales_px = {std::atof(argv[3])};
  settings.beta = std::atof(argv[4]);
  settings.structureness = std::atof(argv[5]);
  settings.smoothing = std::strcmp(argv[6], "int16") == 0 ? tubed::FrangiSmoothing::kInteger16
                                                          : tubed::FrangiSmoothing::kFloat;
  const int width = std::atoi(argv[1]);
  const int height = std::atoi(argv[2]);
  tubed::FrangiFilter filter(width, height, settings);
  std::vector<std::uint8_t> grey(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  std::vector<float> vesselness(grey.size());
  if (std::fread(grey.data(), 1, grey.size(), stdin) != grey.size()) {
    std::fprintf(stderr, "frangi_probe: fewer pixels than width x height on the standard input\n");
    return 65;
  }
  filter.filter(grey, vesselness);
  return std::fwrite(vesselness.data(), sizeof(float), vesselness.size(), stdout) == vesselness.size() ? 0
                                                                                                       : 74;
}
