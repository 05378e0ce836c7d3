#include "methods/contract/restarts.h"

#include <gtest/gtest.h>

#include <vector>

namespace catoptric::methods {
namespace {

struct Step {
  float metres = 0.0f;
  float turnRad = 0.0f;
};

/// A camera that goes along x and turns about y.
class StepPath : public scene::CameraPath {
 public:
  explicit StepPath(std::vector<Step> steps) : steps_(std::move(steps)) {}
  int count() const override { return static_cast<int>(steps_.size()) + 1; }
  scene::PathFrame frame(int number) const override {
    Step sum;
    for (int i = 0; i + 1 < number; ++i) {
      sum.metres += steps_[static_cast<std::size_t>(i)].metres;
      sum.turnRad += steps_[static_cast<std::size_t>(i)].turnRad;
    }
    scene::PathFrame frame;
    frame.number = number;
    frame.camera.worldFromCamera = glm::rotate(Mat4(1.0f), sum.turnRad, Vec3(0, 1, 0));
    frame.camera.worldFromCamera[3].x = sum.metres;
    frame.camera.nearMetres = 0.02f;
    return frame;
  }

 private:
  std::vector<Step> steps_;
};

/// Whether the second of three steps is a cut.
bool cuts(const Step& before, const Step& step, const Step& after) {
  return cutsBefore(StepPath({before, step, after}), 3);
}

TEST(Cuts, AreTenTimesTheStepsOnBothSides) {
  // Metres, then radians: a little more than ten times the longer one, and a little less.
  EXPECT_TRUE(cuts({0.1f}, {1.01f}, {0.05f}));
  EXPECT_TRUE(cuts({0.05f}, {1.01f}, {0.1f}));
  EXPECT_FALSE(cuts({0.1f}, {0.99f}, {0.05f}));
  EXPECT_FALSE(cuts({0.05f}, {0.99f}, {0.1f}));
  EXPECT_TRUE(cuts({0, 0.1f}, {0, 1.01f}, {0, 0.05f}));
  EXPECT_TRUE(cuts({0, 0.05f}, {0, 1.01f}, {0, 0.1f}));
  EXPECT_FALSE(cuts({0, 0.1f}, {0, 0.99f}, {0, 0.05f}));
  EXPECT_FALSE(cuts({0, 0.05f}, {0, 0.99f}, {0, 0.1f}));
  // Each by itself
  EXPECT_TRUE(cuts({0.1f, 0.5f}, {1.01f, 0.5f}, {0.1f, 0.5f}));
  EXPECT_TRUE(cuts({0.5f, 0.1f}, {0.5f, 1.01f}, {0.5f, 0.1f}));
}

TEST(Cuts, AreLongerThanTheNearPlaneIsAwayAndThanRounding) {
  EXPECT_TRUE(cuts({}, {0.021f}, {}));
  EXPECT_FALSE(cuts({}, {0.019f}, {}));
  EXPECT_TRUE(cuts({}, {0, 0.0101f}, {}));
  EXPECT_FALSE(cuts({}, {0, 0.0099f}, {}));
}

TEST(Cuts, AtThePathsEndsHaveOneNeighbour) {
  const StepPath path({{3.0f}, {0.2f}, {0.2f}, {3.0f}});
  const std::vector<bool> expected = {false, true, false, false, true};
  for (int number = 1; number <= path.count(); ++number)
    EXPECT_EQ(cutsBefore(path, number), expected[static_cast<std::size_t>(number) - 1]) << number;
}

TEST(RestartGrid, BeginsWithTheFirstFrame) {
  for (int number = 1; number <= 9; ++number) {
    EXPECT_EQ(onRestartGrid(number, 4), number == 1 || number == 5 || number == 9) << number;
    EXPECT_EQ(onRestartGrid(number, 0), number == 1) << number;
  }
}

}  // namespace
}  // namespace catoptric::methods
