#include "run/folder/memory.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <limits>
#include <map>
#include <optional>
#include <sstream>
#include <vector>

#include "core/error.h"

namespace catoptric::run {
namespace {

namespace fs = std::filesystem;

/// The shares of what a plan says that runs have used, at least and at most (tests/memory.py, every
/// method in 15 scenes but impostors among 900 balls: 0.46). Ours.
constexpr double kLeastShare = 0.5;
constexpr double kLargestShare = 1.2;

constexpr std::size_t kNamedItems = 3;  ///< of an error

/// A number of a file that contains nothing else; none of a file that is absent or says "max".
std::optional<std::uint64_t> numberIn(const fs::path& file) {
  std::ifstream stream(file);
  std::uint64_t number = 0;
  if (stream >> number) return number;
  return std::nullopt;
}

/// Files of lines that begin with a name and a number: /proc/meminfo, memory.stat.
std::map<std::string, std::uint64_t> namedNumbersIn(const fs::path& file) {
  std::map<std::string, std::uint64_t> numbers;
  std::ifstream stream(file);
  for (std::string line; std::getline(stream, line);) {
    std::istringstream words(line);
    std::string name;
    std::uint64_t number = 0;
    if (words >> name >> number) numbers[name] = number;
  }
  return numbers;
}

/// Bytes that this process has mapped, and those of them that are in memory.
struct OwnMemory {
  std::uint64_t mapped = 0;
  std::uint64_t resident = 0;
};

OwnMemory ownMemory(const fs::path& root) {
  std::ifstream stream(root / "proc/self/statm");
  OwnMemory own;
  stream >> own.mapped >> own.resident;
  const auto page = static_cast<std::uint64_t>(::sysconf(_SC_PAGE_SIZE));
  return {own.mapped * page, own.resident * page};
}

/// The names of a control group's files, by version.
struct GroupFiles {
  const char* folder;
  const char* limit;
  const char* usage;
  std::array<const char*, 2> reclaimable;  ///< in memory.stat: the pages of files
};
constexpr GroupFiles kVersion2 = {
    "sys/fs/cgroup", "memory.max", "memory.current", {"active_file", "inactive_file"}};
constexpr GroupFiles kVersion1 = {"sys/fs/cgroup/memory",
                                  "memory.limit_in_bytes",
                                  "memory.usage_in_bytes",
                                  {"total_active_file", "total_inactive_file"}};

/// What a group and those above it leave to their processes; none if nothing limits them.
std::optional<std::uint64_t> leftByGroups(const fs::path& root, const GroupFiles& files,
                                          const std::string& group) {
  std::optional<std::uint64_t> least;
  const fs::path top = root / files.folder;
  fs::path folder = top / fs::path(group).relative_path();
  for (;; folder = folder.parent_path()) {
    const auto limit = numberIn(folder / files.limit);
    const auto usage = numberIn(folder / files.usage);
    if (limit && usage) {
      std::map<std::string, std::uint64_t> stat = namedNumbersIn(folder / "memory.stat");
      const std::uint64_t reclaimable = stat[files.reclaimable[0]] + stat[files.reclaimable[1]];
      const std::uint64_t used = *usage - std::min(*usage, reclaimable);
      const std::uint64_t left = *limit - std::min(*limit, used);
      least = std::min(left, least.value_or(left));
    }
    if (folder == top || folder.empty() || folder == folder.parent_path()) return least;
  }
}

/// The groups of this process that limit its memory.
std::optional<std::uint64_t> leftByGroups(const fs::path& root) {
  std::optional<std::uint64_t> least;
  std::ifstream stream(root / "proc/self/cgroup");
  for (std::string line; std::getline(stream, line);) {  // "0::/group" or "4:memory:/group"
    const std::size_t first = line.find(':');
    const std::size_t second = line.find(':', first + 1);
    if (first == std::string::npos || second == std::string::npos) continue;
    const std::string controllers = "," + line.substr(first + 1, second - first - 1) + ",";
    const bool unified = controllers == ",,";
    if (!unified && controllers.find(",memory,") == std::string::npos) continue;
    const auto left = leftByGroups(root, unified ? kVersion2 : kVersion1, line.substr(second + 1));
    if (left) least = std::min(*left, least.value_or(*left));
  }
  return least;
}

/// Whether a driver of a GPU has made its devices.
bool hasGpu(const fs::path& root) {
  std::error_code ignored;
  if (fs::exists(root / "dev/nvidia0", ignored) || fs::exists(root / "dev/dxg", ignored))
    return true;
  return std::ranges::any_of(fs::directory_iterator(root / "dev/dri", ignored),
                             [](const fs::directory_entry& entry) {
                               return entry.path().filename().string().starts_with("renderD");
                             });
}

std::string needs(const PlannedMethod& method, std::uint64_t bytes,
                  const ObtainableMemory& memory) {
  return method.name + " needs about " + bytesText(bytes) + " of memory; " + memory.limit + " " +
         bytesText(memory.bytes);
}

}  // namespace

std::uint64_t freeMemory(const fs::path& root) {
  const std::uint64_t unlimited = std::numeric_limits<std::uint64_t>::max();
  const std::map<std::string, std::uint64_t> machine = namedNumbersIn(root / "proc/meminfo");
  const auto free = machine.find("MemAvailable:");
  return std::min(free != machine.end() ? free->second * 1024 : unlimited,
                  leftByGroups(root).value_or(unlimited));
}

std::uint64_t peakMemory(const fs::path& root) {
  const std::map<std::string, std::uint64_t> own = namedNumbersIn(root / "proc/self/status");
  if (const auto peak = own.find("VmHWM:"); peak != own.end()) return peak->second * 1024;
  // Begins with the peak of the process that started this one
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

ObtainableMemory obtainableMemory(const fs::path& root) {
  const OwnMemory own = ownMemory(root);
  ObtainableMemory least{std::numeric_limits<std::uint64_t>::max(), "nothing limits it to"};
  const auto limit = [&](std::uint64_t bytes, const char* name) {
    if (bytes < least.bytes) least = {bytes, name};
  };
  const std::map<std::string, std::uint64_t> machine = namedNumbersIn(root / "proc/meminfo");
  if (const auto free = machine.find("MemAvailable:"); free != machine.end()) {
    const auto swap = machine.find("SwapFree:");
    const std::uint64_t kibibytes = free->second + (swap != machine.end() ? swap->second : 0);
    limit(own.resident + kibibytes * 1024, "this machine still has");
  }
  if (const auto left = leftByGroups(root))
    limit(own.resident + *left, "its control group (such as a Slurm job's --mem) allows");
  rlimit space{};
  if (::getrlimit(RLIMIT_AS, &space) == 0 && space.rlim_cur != RLIM_INFINITY) {
    // What is mapped and not used, such as libraries, is not left for data
    const std::uint64_t unused = own.mapped - std::min(own.mapped, own.resident);
    limit(space.rlim_cur - std::min<std::uint64_t>(space.rlim_cur, unused),
          "its limit of address space (ulimit -v) allows");
  }
  least.gpu = hasGpu(root);
  return least;
}

std::string memoryWarning(const Plan& plan, const ObtainableMemory& memory) {
  std::string warning;
  for (const PlannedMethod& method : plan.methods) {
    const std::uint64_t bytes = plan.bytesOf(method);
    if (kLargestShare * static_cast<double>(bytes) <= static_cast<double>(memory.bytes)) continue;
    warning += (warning.empty() ? "" : "\n") + needs(method, bytes, memory) +
               ": it may end for lack of memory, or slow down";
  }
  return warning;
}

void requireMemory(const Plan& plan, const ObtainableMemory& memory) {
  for (const PlannedMethod& method : plan.methods) {
    const std::uint64_t bytes = plan.bytesOf(method);
    if (memory.gpu && method.needs.gl) continue;
    if (kLeastShare * static_cast<double>(bytes) <= static_cast<double>(memory.bytes)) continue;
    std::vector<methods::PlanItem> items = plan.shared;
    items.insert(items.end(), method.items.begin(), method.items.end());
    std::ranges::stable_sort(items, std::greater{}, &methods::PlanItem::bytes);
    std::string text = needs(method, bytes, memory) + ". Its largest parts are:";
    for (std::size_t i = 0; i < std::min(items.size(), kNamedItems); ++i) {
      text += "\n  " + items[i].name + ", " + bytesText(items[i].bytes) + ": " + items[i].reason;
      if (!items[i].lower.empty()) text += "; lowered by " + items[i].lower;
    }
    throw Error(ExitCode::OutOfMemory, text);
  }
}

}  // namespace catoptric::run
