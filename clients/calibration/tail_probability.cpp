#include "clients/calibration/tail_probability.hpp"

#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/fisher_f.hpp>

namespace tubed {

double chi_square_tail(double x, double degrees_of_freedom) {
  const boost::math::chi_squared_distribution<double> distribution(degrees_of_freedom);
  return x <= 0 ? 1 : boost::math::cdf(boost::math::complement(distribution, x));
}

double chi_square_quantile(double p, double degrees_of_freedom) {
  const boost::math::chi_squared_distribution<double> distribution(degrees_of_freedom);
  return boost::math::quantile(distribution, p);
}

double f_tail(double x, double degrees_above, double degrees_below) {
  const boost::math::fisher_f_distribution<double> distribution(degrees_above, degrees_below);
  return x <= 0 ? 1 : boost::math::cdf(boost::math::complement(distribution, x));
}

}  // namespace tubed
