// Text functions for messages.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace catoptric {

/// The candidate with the smallest edit distance to `name`, if `name` is likely to be a misspelling
/// of it: the distance is at most a third of the name's length (a distance of 1 is always allowed).
/// Otherwise empty.
std::string nearestName(std::string_view name, std::span<const std::string> candidates);

/// " (did you mean \"x\"?)" or an empty string.
std::string didYouMean(std::string_view name, std::span<const std::string> candidates);

/// Text that is safe to print on a terminal: control characters, except line breaks and tabs,
/// become \uXXXX (e.g. \u001b), and invalid UTF-8 bytes \xXX.
std::string printable(std::string_view text);

/// A shell word, quoted if needed.
std::string shellWord(const std::string& word);

/// Bytes in base 64 [RFC 4648].
std::string base64(std::span<const std::byte> bytes);

/// A cell of a CSV file [RFC 4180], quoted if needed.
std::string csvCell(const std::string& text);

/// Whether `text` matches `pattern`, in which * matches any characters.
bool matchesPattern(std::string_view text, std::string_view pattern);

/// The value of a hexadecimal digit, or -1 for any other character.
int hexDigit(char c);

std::string joined(std::span<const std::string> items, std::string_view separator);

}  // namespace catoptric
