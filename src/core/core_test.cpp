#include <gtest/gtest.h>

#include <cstdlib>
#include <numeric>

#include "core/disk_cache.h"
#include "core/error.h"
#include "core/file.h"
#include "core/hash.h"
#include "core/log.h"
#include "core/parallel.h"
#include "core/text.h"
#include "core/welding.h"

namespace catoptric {
namespace {

TEST(Log, EqualInfosAndWarningsAreSaidOnce) {
  std::string all;
  log::setFormatter([&](log::Level, const std::string& text) { return all += text + "|"; });
  for (const char* text : {"a", "b", "a"}) {
    log::info(text);
    log::warning(std::string("w") + text);
    log::error("e");
  }
  log::setFormatter({});
  EXPECT_EQ(all, "a|wa|e|b|wb|e|e|");
}

TEST(Text, NearestNameFindsTypingErrors) {
  const std::vector<std::string> names{"traced", "reference", "environment_map"};
  EXPECT_EQ(nearestName("tracd", names), "traced");
  EXPECT_EQ(nearestName("enviroment_map", names), "environment_map");
  EXPECT_EQ(nearestName("tarced", names), "traced");  // a swap is one error
  EXPECT_EQ(nearestName("zzz", names), "");
}

TEST(Text, StarsMatchAnything) {
  EXPECT_TRUE(matchesPattern("", "*"));
  EXPECT_TRUE(matchesPattern("own.box.traced", "own.*.traced"));
  EXPECT_FALSE(matchesPattern("own.box.reference", "own.*.traced"));
  EXPECT_TRUE(matchesPattern("seat_cushion_01", "*cushion*"));
  EXPECT_TRUE(matchesPattern("abcbc", "a*bc"));
  EXPECT_TRUE(matchesPattern("feet", "feet"));
  EXPECT_FALSE(matchesPattern("feet 2", "feet"));
}

TEST(Text, CsvCellsAreQuotedWhereTheyHaveToBe) {
  EXPECT_EQ(csvCell("a"), "a");
  EXPECT_EQ(csvCell("a,\"b\""), "\"a,\"\"b\"\"\"");
}

TEST(Text, ControlCharactersAreShown) {
  EXPECT_EQ(printable("a\tb\nc \xc3\xa4 \xe2\x82\xac \xf0\x9f\x98\x80"),
            "a\tb\nc \xc3\xa4 \xe2\x82\xac \xf0\x9f\x98\x80");
  EXPECT_EQ(printable("\x1b[31mred\r\x7f"), "\\u001b[31mred\\u000d\\u007f");
  EXPECT_EQ(printable("\xc2\x9b"
                      "2J"),
            "\\u009b2J");  // the same in one character
  EXPECT_EQ(printable("\x9b"
                      "2J \xc3"),
            "\\x9b2J \\xc3");  // no UTF-8
  EXPECT_EQ(printable(std::string_view("\0", 1)), "\\u0000");
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

TEST(Welding, NumbersEqualVerticesInOrderOfAppearance) {
  const std::vector<Vec3> places{{1, 0, 2}, {0, 0, 0}, {1, 0, 2}, {-0.0f, 0, -0.0f}, {2, 0, 1}};
  Welding welding;
  welding.weld(places.size(), [&](std::size_t v) { return std::array{places[v]}; });
  EXPECT_EQ(welding.numbers, (std::vector<std::uint32_t>{0, 1, 0, 1, 2}));
  EXPECT_EQ(welding.firsts, (std::vector<std::uint32_t>{0, 1, 4}));
  // Two vectors each: all differ by the second one
  welding.weld(places.size(), [&](std::size_t v) { return std::array{places[v], Vec3(float(v))}; });
  EXPECT_EQ(welding.firsts.size(), places.size());
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

TEST(DiskCache, GivesBackWhatIsWholeAndRefusesTheRest) {
  const auto folder = std::filesystem::temp_directory_path() / "catoptric_cache_test";
  std::filesystem::remove_all(folder);
  constexpr CacheKind kind{"test", {'c', 'a', 't', 't', 'e', 's', 't', '1'}, "", "", ""};
  constexpr CacheKind other{"test", {'c', 'a', 't', 't', 'e', 's', 't', '2'}, "", "", ""};
  const std::vector<float> values{1.0f, 2.0f, 3.0f};
  const CacheEntry entry(kind, folder, 7);
  EXPECT_FALSE(entry.read(3, sizeof(float)));
  entry.write(std::as_bytes(std::span(values)), values.size());
  const auto read = entry.read(3, sizeof(float));
  ASSERT_TRUE(read);
  EXPECT_TRUE(std::equal(read->begin(), read->end(), std::as_bytes(std::span(values)).begin()));
  EXPECT_EQ(entry.readAll(sizeof(float)), read);
  EXPECT_FALSE(CacheEntry(kind, folder, 8).readAll(sizeof(float)));
  EXPECT_FALSE(CacheEntry(kind, folder, 8).read(3, sizeof(float)));  // another key
  EXPECT_FALSE(entry.read(2, sizeof(float)));                        // another size
  EXPECT_FALSE(CacheEntry(other, folder, 7).read(3, sizeof(float)));

  // Any flipped bit is noticed.
  std::filesystem::path file;
  for (const auto& found : std::filesystem::directory_iterator(folder))
    if (found.path().extension() == ".bin") file = found.path();
  std::vector<std::byte> bytes = readFile(file);
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    bytes[i] ^= std::byte{16};
    writeFileAtomically(file, bytes);
    EXPECT_FALSE(entry.read(3, sizeof(float))) << "byte " << i;
    EXPECT_FALSE(entry.readAll(sizeof(float))) << "byte " << i;
    bytes[i] ^= std::byte{16};
  }
  for (const std::size_t size : {std::size_t{0}, std::size_t{8}, bytes.size() - 4}) {
    writeFileAtomically(file, std::span(bytes).first(size));
    EXPECT_FALSE(entry.readAll(sizeof(float))) << size;
  }
  writeFileAtomically(file, bytes);
  EXPECT_TRUE(entry.read(3, sizeof(float)));
  EXPECT_FALSE(CacheEntry(kind, {}, 7).read(3, sizeof(float)));  // no folder, no cache
}

}  // namespace
}  // namespace catoptric
