#include "core/input_files.h"

#include <sys/stat.h>
#include <time.h>

#include <algorithm>
#include <mutex>
#include <vector>

#include "core/file.h"
#include "core/hash.h"

namespace catoptric {
namespace {

/// A file that changed less than this before it was read may change again within the resolution of
/// the file system's clock. Ours; FAT's is 2 s.
constexpr std::int64_t kResolutionNs = 2'000'000'000;

struct Recordings {
  std::mutex mutex;
  std::vector<InputFiles*> live;
};

Recordings& recordings() {
  static Recordings all;
  return all;
}

std::int64_t nanoseconds(const timespec& time) {
  return static_cast<std::int64_t>(time.tv_sec) * 1'000'000'000 + time.tv_nsec;
}

std::uint64_t contentOf(std::span<const std::byte> bytes) {
  Fingerprint print;
  print.add(bytes);
  return print.value();
}

}  // namespace

InputChanged::InputChanged(const std::string& what)
    : UsageError(what +
                 " has changed since this command read it, and results would mix two versions. "
                 "Give the command again (sweep and tune: with --existing resume): it measures the "
                 "present version; of earlier results only those of this version count") {}

InputFiles::Recording::Recording(InputFiles& files) : files_(files) {
  const std::scoped_lock guard(recordings().mutex);
  recordings().live.push_back(&files_);
}

InputFiles::Recording::~Recording() {
  const std::scoped_lock guard(recordings().mutex);
  std::erase(recordings().live, &files_);
}

InputFiles::State InputFiles::stateOf(const struct stat& info, std::uint64_t content) {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  const std::int64_t changed = nanoseconds(info.st_mtim);
  const bool tells = nanoseconds(now) - changed > kResolutionNs;
  return {content, static_cast<std::uint64_t>(info.st_size), info.st_ino, tells ? changed : 0};
}

void InputFiles::add(const InputFiles& others) {
  for (const auto& [file, state] : others.files_) {
    const auto [known, isNew] = files_.emplace(file, state);
    if (!isNew && known->second.content != state.content) throw InputChanged(file.string());
  }
}

void InputFiles::requireUnchanged() {
  for (auto& [file, state] : files_) {
    struct stat info {};
    if (::stat(file.c_str(), &info) != 0) throw InputChanged(file.string());
    if (state.changedNs != 0 && stateOf(info, state.content) == state) continue;
    std::uint64_t content = 0;
    try {
      content = contentOf(readFile(file));
    } catch (const SceneError&) {
      throw InputChanged(file.string());
    }
    if (content != state.content) throw InputChanged(file.string());
    state = stateOf(info, content);
  }
}

std::string InputFiles::print() const {
  Fingerprint print;
  for (const auto& [file, state] : files_) {
    print.add(file.string());
    print.addValue(state.content);
  }
  return print.text();
}

void noteInput(const std::filesystem::path& file, const struct stat& info,
               std::span<const std::byte> bytes) {
  {
    const std::scoped_lock guard(recordings().mutex);
    if (recordings().live.empty()) return;
  }
  const InputFiles::State state = InputFiles::stateOf(info, contentOf(bytes));
  // Of a file that is read twice the first contents count: others are a change
  const std::scoped_lock guard(recordings().mutex);
  for (InputFiles* files : recordings().live) files->files_.emplace(file, state);
}

}  // namespace catoptric
