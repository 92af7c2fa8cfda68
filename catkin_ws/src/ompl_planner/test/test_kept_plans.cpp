/// Motions that the node keeps by number.
#include <gtest/gtest.h>

#include "../src/node/kept_plans.h"

namespace ompl_planner {
namespace {

PlannedMotionPtr onMap(std::uint64_t sequence) {
  PlannedMotion motion;
  motion.map_sequence = sequence;
  return std::make_shared<PlannedMotion>(motion);
}

TEST(KeptPlans, theLastAreKeptAndNoNumberMeansAnother) {
  constexpr std::uint64_t kFirst = 1000;
  constexpr std::uint64_t kCount = 3 * KeptPlans::kKept;
  KeptPlans plans(kFirst);
  EXPECT_EQ(plans.get(kFirst), nullptr);
  for (std::uint64_t i = 0; i < kCount; ++i) EXPECT_EQ(plans.keep(onMap(i)), kFirst + i);
  for (std::uint64_t number = 0; number < kFirst + 2 * kCount; ++number) {
    const bool kept = number >= kFirst + kCount - KeptPlans::kKept && number < kFirst + kCount;
    const PlannedMotionPtr motion = plans.get(number);
    ASSERT_EQ(motion != nullptr, kept) << number;
    if (kept) {
      EXPECT_EQ(motion->map_sequence, number - kFirst);
    }
  }
}

}  // namespace
}  // namespace ompl_planner
