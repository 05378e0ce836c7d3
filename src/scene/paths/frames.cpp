// The frame syntax of the command line: "1-100x2,120".
#include <algorithm>
#include <cctype>

#include "core/error.h"
#include "scene/camera.h"

namespace catoptric::scene {
namespace {

/// Reads the text from left to right and knows where it stands, for messages.
struct FrameParser {
  const std::string& text;
  std::size_t at = 0;

  [[noreturn]] void fail(const std::string& reason, std::size_t where) const {
    throw UsageError("frames \"" + text + "\": character " + std::to_string(where + 1) + ": " +
                     reason + "; expected ranges such as \"1-100x2,120\"");
  }

  void skipSpaces() {
    while (at < text.size() && text[at] == ' ') ++at;
  }

  bool accept(char c) {
    skipSpaces();
    if (at >= text.size() || text[at] != c) return false;
    ++at;
    return true;
  }

  int number(const char* what) {
    skipSpaces();
    const std::size_t start = at;
    long long value = 0;
    while (at < text.size() && std::isdigit(static_cast<unsigned char>(text[at])) != 0) {
      value = value * 10 + (text[at] - '0');
      if (value > 1'000'000'000) fail(std::string(what) + " is too large", start);
      ++at;
    }
    if (at == start) {
      fail(at < text.size() ? std::string("'") + text[at] + "', but " + what + " was expected"
                            : std::string("the text ends, but ") + what + " was expected",
           start);
    }
    if (value == 0) fail(std::string(what) + " is 0; frames are numbered from 1", start);
    return static_cast<int>(value);
  }
};

}  // namespace

std::vector<int> parseFrames(const std::string& text, int count) {
  FrameParser parser{text};
  std::vector<int> frames;
  do {
    parser.skipSpaces();
    const std::size_t start = parser.at;
    const int first = parser.number("a frame number");
    int last = first;
    int step = 1;
    if (parser.accept('-')) {
      last = parser.number("the range's last frame");
      if (parser.accept('x')) step = parser.number("the step");
    }
    if (last < first) {
      parser.fail(
          "the range " + std::to_string(first) + "-" + std::to_string(last) + " runs backwards",
          start);
    }
    if (last > count) {
      parser.fail("frame " + std::to_string(last) + " is beyond the path's " +
                      std::to_string(count) + (count == 1 ? " frame" : " frames"),
                  start);
    }
    for (long long f = first; f <= last; f += step) frames.push_back(static_cast<int>(f));
  } while (parser.accept(','));
  parser.skipSpaces();
  if (parser.at != text.size()) {
    parser.fail(std::string("unexpected '") + text[parser.at] + "'", parser.at);
  }
  std::sort(frames.begin(), frames.end());
  frames.erase(std::unique(frames.begin(), frames.end()), frames.end());
  return frames;
}

std::string formatFrames(const std::vector<int>& input) {
  std::vector<int> frames = input;
  std::sort(frames.begin(), frames.end());
  frames.erase(std::unique(frames.begin(), frames.end()), frames.end());
  std::string text;
  for (std::size_t i = 0; i < frames.size();) {
    // The longest run of equal steps from here; a step above 1 needs three frames to be worth it.
    std::size_t end = i + 1;
    if (end < frames.size()) {
      const int step = frames[end] - frames[i];
      while (end + 1 < frames.size() && frames[end + 1] - frames[end] == step) ++end;
      if (step > 1 && end - i < 2) end = i;
    } else {
      end = i;
    }
    if (!text.empty()) text += ',';
    text += std::to_string(frames[i]);
    if (end > i) {
      const int step = frames[i + 1] - frames[i];
      text += '-' + std::to_string(frames[end]);
      if (step > 1) text += 'x' + std::to_string(step);
    }
    i = end + 1;
  }
  return text;
}

}  // namespace catoptric::scene
