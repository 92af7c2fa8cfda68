#include "subproblems.h"

#include <algorithm>

namespace fv_robot_model::ik {

namespace {

double evaluate(const std::array<double, 5>& a, int degree, double x) {
  double value = a[static_cast<size_t>(degree)];
  for (int i = degree; i-- > 0;) value = value * x + a[static_cast<size_t>(i)];
  return value;
}

double evaluateAbsolute(const std::array<double, 5>& a, int degree, double x) {
  double value = std::abs(a[static_cast<size_t>(degree)]);
  for (int i = degree; i-- > 0;) value = value * std::abs(x) + std::abs(a[static_cast<size_t>(i)]);
  return value;
}

std::array<double, 5> derivative(const std::array<double, 5>& a, int degree) {
  std::array<double, 5> d{};
  for (int i = 1; i <= degree; ++i) d[static_cast<size_t>(i - 1)] = i * a[static_cast<size_t>(i)];
  return d;
}

/// The root between lo and hi, where the polynomial changes its sign: Newton, kept inside by bisection.
double bracketedRoot(const std::array<double, 5>& a, const std::array<double, 5>& slope, int degree,
                     double lo, double hi) {
  const bool rising = evaluate(a, degree, hi) > 0.0;
  double x = 0.5 * (lo + hi);
  for (int i = 0; i < 80; ++i) {
    const double value = evaluate(a, degree, x);
    ((value > 0.0) == rising ? hi : lo) = x;
    const double newton = x - value / evaluate(slope, degree - 1, x);
    const double next = newton > lo && newton < hi ? newton : 0.5 * (lo + hi);
    if (std::abs(next - x) <= 1e-15 * (1.0 + std::abs(x))) return next;
    x = next;
  }
  return x;
}

double rootBound(const std::array<double, 5>& a, int degree) {
  double largest = 0.0;
  for (int i = 0; i < degree; ++i) largest = std::max(largest, std::abs(a[static_cast<size_t>(i)]));
  return 1.0 + largest / std::abs(a[static_cast<size_t>(degree)]);  // Cauchy
}

void addRoot(RealRoots& roots, double x) {
  if (roots.count < static_cast<int>(roots.root.size())) roots.root[static_cast<size_t>(roots.count++)] = x;
}

}  // namespace

RealRoots realRoots(const std::array<double, 5>& a, int degree) {
  RealRoots roots;
  while (degree > 0 && a[static_cast<size_t>(degree)] == 0.0) --degree;
  if (degree == 0) return roots;
  if (degree == 1) {
    addRoot(roots, -a[0] / a[1]);
    return roots;
  }
  // Between neighbouring extrema the polynomial is monotonous: each sign change is exactly one root.
  const std::array<double, 5> slope = derivative(a, degree);
  const RealRoots extrema = realRoots(slope, degree - 1);
  const double bound = rootBound(a, degree);
  double lo = -bound;
  double value_lo = evaluate(a, degree, lo);
  for (int i = 0; i <= extrema.count; ++i) {
    const double hi = i < extrema.count ? extrema.root[static_cast<size_t>(i)] : bound;
    const double value_hi = evaluate(a, degree, hi);
    const bool touches = i < extrema.count && std::abs(value_hi) < 1e-13 * evaluateAbsolute(a, degree, hi);
    if ((value_lo < 0.0) != (value_hi < 0.0)) {
      addRoot(roots, bracketedRoot(a, slope, degree, lo, hi));
    } else if (touches) {
      addRoot(roots, hi);  // a double root, lifted off zero by rounding
    }
    lo = hi;
    value_lo = value_hi;
  }
  return roots;
}

QuarticAngles quarticAngles(const std::array<double, 6>& k) {
  // The half-angle substitution sends one angle to infinity: choose the one where the function is largest.
  CosSin far{1.0, 0.0};
  double largest = -1.0;
  constexpr int kCandidates = 8;
  for (int i = 0; i < kCandidates; ++i) {
    const CosSin a = cosSin(2.0 * M_PI * i / kCandidates);
    const double f = k[0] + k[1] * a.c + k[2] * a.s + k[3] * a.c * a.c + k[4] * a.c * a.s + k[5] * a.s * a.s;
    if (std::abs(f) > largest) {
      largest = std::abs(f);
      far = a;
    }
  }
  // theta = theta0 + tau with theta0 opposite of far: (c, s) = (c0 ct - s0 st, s0 ct + c0 st).
  const double c0 = -far.c;
  const double s0 = -far.s;
  const double l1 = k[1] * c0 + k[2] * s0;
  const double l2 = -k[1] * s0 + k[2] * c0;
  const double q1 = k[3] * c0 * c0 + k[4] * c0 * s0 + k[5] * s0 * s0;
  const double q2 = 2.0 * (k[5] - k[3]) * c0 * s0 + k[4] * (c0 * c0 - s0 * s0);
  const double q3 = k[3] * s0 * s0 - k[4] * c0 * s0 + k[5] * c0 * c0;
  // With t = tan(tau / 2), times (1 + t^2)^2.
  const std::array<double, 5> polynomial{k[0] + l1 + q1, 2.0 * (l2 + q2), 2.0 * k[0] - 2.0 * q1 + 4.0 * q3,
                                         2.0 * (l2 - q2), k[0] - l1 + q1};
  const RealRoots t = realRoots(polynomial, 4);
  QuarticAngles angles;
  for (int i = 0; i < t.count; ++i) {
    const double x = t.root[static_cast<size_t>(i)];
    const double ct = (1.0 - x * x) / (1.0 + x * x);
    const double st = 2.0 * x / (1.0 + x * x);
    angles.root[static_cast<size_t>(angles.count++)] = {c0 * ct - s0 * st, s0 * ct + c0 * st};
  }
  return angles;
}

}  // namespace fv_robot_model::ik
