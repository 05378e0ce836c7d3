#include <gtest/gtest.h>

#include <cstdlib>
#include <numeric>

#include "core/error.h"
#include "core/file.h"
#include "core/hash.h"
#include "core/parallel.h"
#include "core/text.h"

namespace catoptric {
namespace {

TEST(Text, NearestNameFindsTypingErrors) {
  const std::vector<std::string> names{"traced", "reference", "environment_map"};
  EXPECT_EQ(nearestName("tracd", names), "traced");
  EXPECT_EQ(nearestName("enviroment_map", names), "environment_map");
  EXPECT_EQ(nearestName("tarced", names), "traced");  // a swap is one error
  EXPECT_EQ(nearestName("zzz", names), "");
}

TEST(Fingerprint, DependsOnEveryByteAndOnPieceBorders) {
  const auto of = [](std::string_view a, std::string_view b) {
    Fingerprint f;
    f.add(a);
    f.add(b);
    return f.text();
  };
  EXPECT_EQ(of("abc", "def"), of("abc", "def"));
  EXPECT_NE(of("abc", "def"), of("abcd", "ef"));
  EXPECT_NE(of("abc", "def"), of("abc", "deg"));
  EXPECT_NE(of("", ""), of("", std::string_view("\0", 1)));
}

TEST(Parallel, CoversEveryItemOnce) {
  std::vector<int> hits(10007, 0);
  parallelFor(hits.size(), 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) ++hits[i];
  });
  EXPECT_TRUE(std::all_of(hits.begin(), hits.end(), [](int h) { return h == 1; }));
}

TEST(File, WriteLeavesOnlyTheWholeFile) {
  const auto folder = std::filesystem::temp_directory_path() / "catoptric_core_test";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  writeFileAtomically(folder / "a.txt", std::string_view("one"));
  writeFileAtomically(folder / "a.txt", std::string_view("two"));
  EXPECT_EQ(readTextFile(folder / "a.txt"), "two");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder), {}), 1);
  EXPECT_THROW(writeFileAtomically(folder / "none" / "b", std::string_view("x")), OutputError);
  EXPECT_THROW(readFile(folder), SceneError);
  EXPECT_THROW(readFile(folder / "a.txt", 2), SceneError);
}

}  // namespace
}  // namespace catoptric
