// A test's parameter: the machine's vector code, or less of it.
#pragma once

#include <gtest/gtest.h>

#include "core/vector_level.h"

namespace catoptric {

class VectorLevels : public testing::TestWithParam<VectorLevel> {
 protected:
  void SetUp() override {
    limitVectorLevel(GetParam());
    if (vectorLevel() != GetParam()) GTEST_SKIP() << "this machine has no such instructions";
  }
  void TearDown() override { limitVectorLevel(VectorLevel::V4); }
};

}  // namespace catoptric
