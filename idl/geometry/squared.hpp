// The square of a number, for formulae whose operand is an expression.
#pragma once

namespace tubed {

constexpr double squared(double x) { return x * x; }

}  // namespace tubed
