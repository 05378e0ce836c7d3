#include "gl/probe.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <exception>
#include <filesystem>
#include <optional>
#include <set>
#include <string_view>
#include <vector>

#include "core/error.h"
#include "core/file.h"
#include "core/hash.h"
#include "core/log.h"

extern char** environ;

namespace catoptric::gl {
namespace {

namespace fs = std::filesystem;

constexpr int kPatienceMs = 60'000;  // for a driver that gives no answer; ours

// The first byte of a child's answer.
constexpr char kResult = 'r';
constexpr char kFailure = 'f';  // message, NUL, what to do

constexpr const char* kWhenDead =
    "repair or replace the driver, unset GALLIUM_DRIVER, raise a limit of address space (ulimit "
    "-v), or use another device";

/// Does the work and reports to the pipe. Nothing of the parent may run here afterwards.
[[noreturn]] void serve(const std::function<std::string()>& task, int pipe) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  const rlimit none{0, 0};
  ::setrlimit(RLIMIT_CORE, &none);
  for (const int number : {SIGSEGV, SIGBUS, SIGABRT, SIGILL, SIGFPE}) std::signal(number, SIG_DFL);
  std::string answer;
  try {
    answer = kResult + task();
  } catch (const PlatformFailure& failure) {
    answer = kFailure + failure.message + '\0' + failure.whatToDo;
  } catch (const std::exception& error) {
    answer = kFailure + messageOf(error) + '\0' + kWhenDead;
  }
  for (std::size_t done = 0; done < answer.size();) {
    const ssize_t n = ::write(pipe, answer.data() + done, answer.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) break;
    done += static_cast<std::size_t>(n);
  }
  ::_exit(0);
}

/// What the child writes until it ends; nothing if it took too long.
std::optional<std::string> answerOf(int pipe) {
  std::string answer;
  for (;;) {
    pollfd place{pipe, POLLIN, 0};
    const int ready = ::poll(&place, 1, kPatienceMs);
    if (ready < 0 && errno == EINTR) continue;
    if (ready == 0) return {};
    std::array<char, 4096> bytes{};
    const ssize_t n = ::read(pipe, bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return answer;
    answer.append(bytes.data(), static_cast<std::size_t>(n));
  }
}

/// Thrown if no child can be made.
struct NoChild {
  int cause;  ///< errno
};

/// The child's answer: kResult or kFailure and more. Throws PlatformFailure if there is none, and
/// NoChild.
std::string askChild(const std::function<std::string()>& task) {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) throw NoChild{errno};
  const pid_t child = ::fork();
  const int cause = errno;
  if (child == 0) serve(task, ends[1]);
  ::close(ends[1]);
  if (child < 0) {
    ::close(ends[0]);
    throw NoChild{cause};
  }
  const std::optional<std::string> answer = answerOf(ends[0]);
  ::close(ends[0]);
  if (!answer) ::kill(child, SIGKILL);
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (!answer)
    throw PlatformFailure{
        "the driver gave no answer for " + std::to_string(kPatienceMs / 1000) + " s", kWhenDead};
  if (WIFSIGNALED(status)) {
    const char* name = ::sigabbrev_np(WTERMSIG(status));
    throw PlatformFailure{"the driver crashed (SIG" + std::string(name != nullptr ? name : "?") +
                              ": " + ::strsignal(WTERMSIG(status)) + ")",
                          kWhenDead};
  }
  if (answer->empty())
    throw PlatformFailure{
        "the driver ended the process with exit code " + std::to_string(WEXITSTATUS(status)),
        kWhenDead};
  return *answer;
}

/// Adds when a file was written and how large it is; a missing file counts as well.
void addFile(Fingerprint& print, const fs::path& path) {
  struct stat found {};
  if (::stat(path.c_str(), &found) != 0) found = {};
  print.addValue(found.st_mtim.tv_sec);
  print.addValue(found.st_mtim.tv_nsec);
  print.addValue(found.st_size);
}

/// A file of the cache that exists if the device's driver, as it is installed here and with this
/// environment, is known not to die. Empty: there is no cache, or nothing can be known.
fs::path recordOf(const std::string& device) {
  rlimit space{};
  if (::getrlimit(RLIMIT_AS, &space) != 0 || space.rlim_cur != RLIM_INFINITY) return {};
  const fs::path folder = cacheFolder();
  if (folder.empty()) return {};

  Fingerprint print;
  print.add(device);
  std::array<char, 256> host{};
  ::gethostname(host.data(), host.size() - 1);
  print.add(std::string_view(host.data()));
  // The variables that drivers and their loaders read.
  std::set<std::string_view> variables;
  for (char** entry = environ; *entry != nullptr; ++entry)
    for (const std::string_view prefix : {"GALLIUM_", "LIBGL_", "MESA_", "EGL_", "__EGL_", "__GL",
                                          "LP_", "LD_", "DRI_", "NVIDIA_", "CUDA_", "ASAN_"})
      if (std::string_view(*entry).starts_with(prefix)) variables.insert(*entry);
  for (const std::string_view variable : variables) print.add(variable);
  // Installing a library rewrites the loader's cache; a GPU's driver adds device files.
  for (const char* path : {"/etc/ld.so.cache", "/usr/share/glvnd/egl_vendor.d",
                           "/etc/glvnd/egl_vendor.d", "/dev/dri", "/dev/nvidiactl"})
    addFile(print, path);
  return folder / ("driver-" + print.text());
}

}  // namespace

std::string inChild(const std::function<std::string()>& work) {
  try {
    const std::string answer = askChild(work);
    if (answer.front() == kResult) return answer.substr(1);
    const std::size_t end = std::min(answer.find('\0'), answer.size() - 1);
    throw PlatformFailure{answer.substr(1, end - 1), answer.substr(end + 1)};
  } catch (const NoChild& none) {
    throw PlatformFailure{
        "no process can be started to try it: " + std::string(std::strerror(none.cause)),
        "end other programs, or raise the limit of processes (ulimit -u)"};
  }
}

void requireSurvival(const std::string& device, const std::function<void()>& work) {
  static std::set<std::string> survived;  // in this process
  if (survived.contains(device)) return;
  const fs::path record = recordOf(device);
  std::error_code ignored;
  if (record.empty() || !fs::exists(record, ignored)) {
    try {
      askChild([&] {
        work();
        return std::string();
      });
      if (!record.empty()) writeFileAtomically(record, std::string_view(""));
    } catch (const NoChild&) {
      log::debug(device + " is used untried: no process could be started to try it");
    } catch (const OutputError& error) {
      log::debug(error.what());  // it is tried again next time
    }
  }
  survived.insert(device);
}

}  // namespace catoptric::gl
