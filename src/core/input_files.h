// The input files of a command that runs for long: what they contained when they were read, and
// whether they still do. A study whose scene is edited meanwhile would mix two scenes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>

#include "core/error.h"

struct stat;

namespace catoptric {

/// An input file has changed since it was read. The message says what to do.
struct InputChanged : UsageError {
  /// `what`: the file, or what else has changed.
  explicit InputChanged(const std::string& what);
};

class InputFiles {
 public:
  /// While it lives, readFile() adds each file that any thread reads.
  class Recording {
   public:
    explicit Recording(InputFiles& files);
    ~Recording();
    Recording(const Recording&) = delete;
    Recording& operator=(const Recording&) = delete;

   private:
    InputFiles& files_;
  };

  /// Adds the files of `others`. Throws InputChanged if one of them had other contents here.
  void add(const InputFiles& others);
  /// Throws InputChanged, which names the file, if the contents of a file have changed. A file is
  /// read again only if its size or its time of change differs.
  void requireUnchanged();
  /// The fingerprint of all names and contents.
  std::string print() const;

 private:
  friend void noteInput(const std::filesystem::path&, const struct stat&,
                        std::span<const std::byte>);
  struct State {
    std::uint64_t content = 0;  ///< fingerprint
    std::uint64_t size = 0;
    std::uint64_t inode = 0;
    std::int64_t changedNs = 0;  ///< 0: so near to the moment of reading that it tells nothing
    bool operator==(const State&) const = default;
  };
  static State stateOf(const struct stat& info, std::uint64_t content);

  std::map<std::filesystem::path, State> files_;
};

/// Called by readFile().
void noteInput(const std::filesystem::path& file, const struct stat& info,
               std::span<const std::byte> bytes);

}  // namespace catoptric
