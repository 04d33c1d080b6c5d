#pragma once
/// Minimum of a unimodal function of one variable without derivatives.
/// Source: J. Kiefer (1953), Sequential minimax search for a maximum, Proc. AMS 4(3).

namespace sparflow {

/// The bracket that is left, and the better of the two points inside it.
struct GoldenSection {
  double lo = 0.0, hi = 0.0;
  double x = 0.0, value = 0.0;
};

/// @param steps each shrinks the bracket to 0.618 of its width and costs one evaluation
/// @param width at which it ends before all steps are done
template <class F>
GoldenSection golden_section(double lo, double hi, int steps, const F& f, double width = 0.0) {
  // no threshold: mathematics
  constexpr double kShare = 0.6180339887498949;  // (sqrt(5) - 1) / 2
  double x1 = hi - kShare * (hi - lo), x2 = lo + kShare * (hi - lo);
  double f1 = f(x1), f2 = f(x2);
  for (int i = 0; i < steps && hi - lo > width; ++i) {
    if (f1 < f2) {
      hi = x2, x2 = x1, f2 = f1;
      x1 = hi - kShare * (hi - lo);
      f1 = f(x1);
    } else {
      lo = x1, x1 = x2, f1 = f2;
      x2 = lo + kShare * (hi - lo);
      f2 = f(x2);
    }
  }
  return f1 < f2 ? GoldenSection{lo, hi, x1, f1} : GoldenSection{lo, hi, x2, f2};
}

}  // namespace sparflow
