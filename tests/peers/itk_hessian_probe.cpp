// itk_hessian_probe WIDTH HEIGHT SIGMA: 8-bit pixels in, ITK's lxx, lxy, lyy as floats out, image after
// image.
#include <itkImage.h>
#include <itkRecursiveGaussianImageFilter.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <vector>

namespace {

using Picture = itk::Image<float, 2>;
using Gaussian = itk::RecursiveGaussianImageFilter<Picture, Picture>;

Picture::Pointer derived(const Picture::Pointer& from, double sigma, unsigned direction,
                         itk::GaussianOrderEnum order) {
  auto filter = Gaussian::New();
  filter->SetInput(from);
  filter->SetSigma(sigma);
  filter->SetDirection(direction);
  filter->SetOrder(order);
  filter->SetNormalizeAcrossScale(false);
  filter->Update();
  return filter->GetOutput();
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fprintf(stderr, "usage: itk_hessian_probe WIDTH HEIGHT SIGMA\n");
    return 64;
  }
  const auto width = static_cast<std::size_t>(std::atoi(argv[1]));
  const auto height = static_cast<std::size_t>(std::atoi(argv[2]));
  const double sigma = std::atof(argv[3]);
  std::vector<std::uint8_t> grey(width * height);
  if (std::fread(grey.data(), 1, grey.size(), stdin) != grey.size()) {
    return 65;
  }
  auto picture = Picture::New();
  picture->SetRegions(Picture::SizeType{{width, height}});
  picture->Allocate();
  std::copy(grey.begin(), grey.end(), picture->GetBufferPointer());
  using Order = itk::GaussianOrderEnum;
  for (const auto& [along_x, along_y] : {std::pair{Order::SecondOrder, Order::ZeroOrder},
                                         {Order::FirstOrder, Order::FirstOrder},
                                         {Order::ZeroOrder, Order::SecondOrder}}) {
    const auto result = derived(derived(picture, sigma, 0, along_x), sigma, 1, along_y);
    std::fwrite(result->GetBufferPointer(), sizeof(float), grey.size(), stdout);
  }
  return 0;
}
