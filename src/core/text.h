// Small text helpers for messages.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace catoptric {

/// The candidate with the smallest edit distance to `name`, if it is near enough to be a likely
/// typing error (at most a third of its length, at least 1); empty otherwise.
std::string nearestName(std::string_view name, std::span<const std::string> candidates);

/// " (did you mean \"x\"?)" or an empty string.
std::string didYouMean(std::string_view name, std::span<const std::string> candidates);

/// Text for a terminal: control characters but for line breaks and tabs as \u001b, bytes that are
/// no UTF-8 as \x80.
std::string printable(std::string_view text);

/// A word for a shell, in quotes where it needs them.
std::string shellWord(const std::string& word);

/// Bytes in base 64 [RFC 4648].
std::string base64(std::span<const std::byte> bytes);

/// A cell of a CSV file [RFC 4180], in quotes where it needs them.
std::string csvCell(const std::string& text);

/// Does `text` match `pattern`, in which * stands for anything?
bool matchesPattern(std::string_view text, std::string_view pattern);

/// The value of a hexadecimal digit; -1: it is none.
int hexDigit(char c);

std::string joined(std::span<const std::string> items, std::string_view separator);

}  // namespace catoptric
