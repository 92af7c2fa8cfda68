#include <gtest/gtest.h>

#include <random>

#include "ik/joint_range.h"

namespace fv_robot_model::ik {
namespace {

TEST(JointRange, NeverRefusesWhatFitsAndRefusesWhatIsClearlyOutside) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> bound(-4.0, 4.0);
  for (int i = 0; i < 2000; ++i) {
    const double a = bound(random), b = bound(random);
    const JointRange range(std::min(a, b), std::max(a, b), 1e-9);
    for (int k = 0; k < 50; ++k) {
      // Some angles lie exactly on a limit, where the cosine is at its worst.
      double angle = k % 3 == 0 ? range.lower() : (k % 3 == 1 ? range.upper() : bound(random));
      const bool admitted = range.admits(cosSin(angle));
      const double asked = angle;
      if (range.fit(angle)) {
        EXPECT_TRUE(admitted) << asked << " in " << range.lower() << " " << range.upper();
      } else {
        // Rounding of a cosine hides at most some 1e-7 rad next to a range that has no or nearly a full
        // width.
        const double middle = 0.5 * (range.lower() + range.upper());
        const double beyond =
            std::abs(std::remainder(asked - middle, 2.0 * M_PI)) - 0.5 * (range.upper() - range.lower());
        EXPECT_TRUE(!admitted || beyond < 1e-7) << asked;
      }
    }
  }
}

}  // namespace
}  // namespace fv_robot_model::ik
