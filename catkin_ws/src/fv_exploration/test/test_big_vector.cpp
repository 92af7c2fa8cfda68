// Elements that ask for lines of the cache get them, in small pieces of memory and in large ones.
#include <gtest/gtest.h>

#include <cstdint>

#include "big_vector.h"

namespace {

struct alignas(64) Line {
  int number;
};

TEST(BigVector, ElementsLieWhereTheirTypeAsks) {
  for (const std::size_t count : {1, 2, 3, 50, 100000}) {
    std::vector<fv::BigVector<Line>> several(5, fv::BigVector<Line>(count));
    for (const fv::BigVector<Line>& lines : several)
      EXPECT_EQ(reinterpret_cast<std::uintptr_t>(lines.data()) % alignof(Line), 0u) << count;
  }
}

}  // namespace
