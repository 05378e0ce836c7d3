// Tests which fields of a struct a fingerprint depends on. A test names all fields in a structured
// binding and changes each of them in turn. If a field is added, the test no longer compiles.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <type_traits>
#include <vector>

#include "core/math.h"

namespace catoptric::test {

inline void change(bool& value) {
  value = !value;
}
template <class T>
requires(std::is_arithmetic_v<T> || std::is_enum_v<T>) void change(T& value) {
  if constexpr (std::is_enum_v<T>) {
    value = value == T{} ? static_cast<T>(1) : T{};
  } else {
    value = static_cast<T>(value + T{1});
  }
}
inline void change(std::string& value) {
  value += "x";
}
inline void change(std::filesystem::path& value) {
  value += "x";
}
// Changes the last component of vectors and matrices, because it is the most likely to be
// forgotten.
template <int N, class T>
void change(glm::vec<N, T>& value) {
  change(value[N - 1]);
}
template <int C, int R, class T>
void change(glm::mat<C, R, T>& value) {
  change(value[C - 1]);
}
inline void change(Quat& value) {
  change(value[3]);
}
/// Changes the last item; if the item cannot be changed, it is appended once more.
template <class T>
void change(std::vector<T>& items) {
  if constexpr (requires(T & item) { change(item); }) {
    change(items.back());
  } else {
    items.push_back(items.back());
  }
}

template <class Print, class Field>
bool counts(const Print& print, Field& field) {
  const auto before = print();
  const Field kept = field;
  change(field);
  const bool differs = print() != before;
  field = kept;
  return differs;
}

/// Expects that `print()` changes whenever any single field changes.
template <class Print, class... Fields>
void expectAllCount(const Print& print, Fields&... fields) {
  EXPECT_THAT((std::vector<int>{counts(print, fields)...}), ::testing::Each(1))
      << "fields that do not count have 0, in the order of the test's list";
}

/// Expects that `print()` stays the same whichever field changes.
template <class Print, class... Fields>
void expectNoneCounts(const Print& print, Fields&... fields) {
  EXPECT_THAT((std::vector<int>{counts(print, fields)...}), ::testing::Each(0));
}

}  // namespace catoptric::test
