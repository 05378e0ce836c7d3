#include "core/file.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <optional>

#include "core/error.h"
#include "core/hash.h"
#include "core/input_files.h"

namespace catoptric {
namespace {

class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  int get() const { return fd_; }
  /// Closes and reports the result of close(2).
  int close() {
    const int result = ::close(fd_);
    fd_ = -1;
    return result;
  }

 private:
  int fd_;
};

std::string reason() {
  return std::strerror(errno);
}

void readInto(const std::filesystem::path& path, std::size_t maxBytes, auto& bytes) {
  // O_NONBLOCK: a FIFO must not hang us before we see that it is no regular file.
  Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (file.get() < 0) throw SceneError(path.string() + ": cannot be opened: " + reason());
  struct stat info {};
  if (::fstat(file.get(), &info) != 0 || !S_ISREG(info.st_mode))
    throw SceneError(path.string() + ": not a regular file");
  const auto size = static_cast<std::size_t>(info.st_size);
  if (size > maxBytes)
    throw SceneError(path.string() + ": " + std::to_string(size) + " bytes, more than the " +
                     std::to_string(maxBytes) + " allowed");
  bytes.resize(size);
  std::size_t done = 0;
  while (done < size) {
    const ssize_t n = ::read(file.get(), reinterpret_cast<char*>(bytes.data()) + done, size - done);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) throw SceneError(path.string() + ": cannot be read: " + reason());
    done += static_cast<std::size_t>(n);
  }
  noteInput(path, info, std::as_bytes(std::span(bytes.data(), bytes.size())));
}

/// Of a file ".NAME.PID@SPACE.XXXXXX.tmp".
struct TemporaryOwner {
  pid_t process = 0;
  std::string_view space;
};

/// Nothing for other names.
std::optional<TemporaryOwner> temporaryOwner(std::string_view name) {
  constexpr std::string_view kEnd = ".tmp";
  constexpr std::size_t kRandom = 7;  // ".XXXXXX"
  if (!name.starts_with(".") || !name.ends_with(kEnd)) return std::nullopt;
  name.remove_suffix(kEnd.size());
  if (name.size() < kRandom || name[name.size() - kRandom] != '.') return std::nullopt;
  name.remove_suffix(kRandom);
  const std::size_t at = name.rfind('@');
  if (at == std::string_view::npos) return std::nullopt;
  TemporaryOwner owner{0, name.substr(at + 1)};
  name = name.substr(0, at);
  const std::size_t dot = name.rfind('.');
  if (dot == 0 || dot == std::string_view::npos) return std::nullopt;
  const auto [end, error] =
      std::from_chars(name.data() + dot + 1, name.data() + name.size(), owner.process);
  if (error != std::errc() || end != name.data() + name.size() || owner.process <= 0)
    return std::nullopt;
  return owner;
}

/// Whether a temporary file is nobody's any more.
bool isLeftOver(const std::filesystem::directory_entry& file) {
  const std::string name = file.path().filename().string();
  const std::optional<TemporaryOwner> owner = temporaryOwner(name);
  if (!owner) return false;
  if (owner->space == processSpace())
    return owner->process == ::getpid() || (::kill(owner->process, 0) != 0 && errno == ESRCH);
  std::error_code error;
  const auto written = file.last_write_time(error);
  return !error && std::filesystem::file_time_type::clock::now() - written > std::chrono::hours(1);
}

}  // namespace

std::vector<std::byte> readFile(const std::filesystem::path& path, std::size_t maxBytes) {
  std::vector<std::byte> bytes;
  readInto(path, maxBytes, bytes);
  return bytes;
}

std::string readTextFile(const std::filesystem::path& path, std::size_t maxBytes) {
  std::string text;
  readInto(path, maxBytes, text);
  return text;
}

void writeFileAtomically(const std::filesystem::path& path, std::span<const std::byte> bytes) {
  const std::filesystem::path folder = path.parent_path().empty() ? "." : path.parent_path();
  std::string temporary = temporaryName(path, "XXXXXX").string();
  Descriptor file(::mkostemps(temporary.data(), 4, O_CLOEXEC));
  if (file.get() < 0)
    throw OutputError(path.string() + ": no file can be created in its folder: " + reason());
  const auto fail = [&](const char* what) {
    const std::string cause = reason();
    ::unlink(temporary.c_str());
    throw OutputError(path.string() + ": " + what + ": " + cause);
  };
  ::fchmod(file.get(), 0644);
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t n = ::write(file.get(), bytes.data() + done, bytes.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n == 0) errno = ENOSPC;
    if (n <= 0) fail("cannot be written");
    done += static_cast<std::size_t>(n);
  }
  if (::fsync(file.get()) != 0) fail("cannot be flushed to the disk");
  if (file.close() != 0) fail("cannot be closed");  // network file systems report a full disk here
  if (::rename(temporary.c_str(), path.c_str()) != 0) fail("cannot be renamed into place");
  syncFolder(folder);
}

void syncFolder(const std::filesystem::path& folder) {
  Descriptor directory(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (directory.get() >= 0 && ::fsync(directory.get()) == 0) return;
  // Some file systems cannot sync a folder; a folder without read permission cannot be opened.
  if (errno == EINVAL || errno == ENOTSUP || errno == EACCES) return;
  throw OutputError(folder.string() + ": the folder cannot be flushed to the disk: " + reason());
}

std::string processSpace() {
  static const std::string space = [] {
    Fingerprint print;
    std::error_code none;
    print.add(std::filesystem::read_symlink("/proc/self/ns/pid", none).string());
    std::array<char, 64> boot{};  // a file of /proc has no size that readFile() could go by
    Descriptor file(::open("/proc/sys/kernel/random/boot_id", O_RDONLY | O_CLOEXEC));
    if (file.get() >= 0 && ::read(file.get(), boot.data(), boot.size() - 1) > 0)
      print.add(std::string_view(boot.data()));
    std::array<char, 256> host{};
    ::gethostname(host.data(), host.size() - 1);
    print.add(std::string_view(host.data()));
    constexpr std::size_t kDigits = 8;
    return print.text().substr(0, kDigits);
  }();
  return space;
}

std::filesystem::path temporaryName(const std::filesystem::path& path, std::string_view ending) {
  const std::filesystem::path folder = path.parent_path().empty() ? "." : path.parent_path();
  return folder / ("." + path.filename().string() + "." + std::to_string(::getpid()) + "@" +
                   processSpace() + "." + std::string(ending) + ".tmp");
}

int sweepTemporaryFiles(const std::filesystem::path& folder) {
  std::error_code error;
  std::vector<std::filesystem::path> stale;
  for (std::filesystem::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error))
    if (isLeftOver(*entry)) stale.push_back(entry->path());
  for (const std::filesystem::path& file : stale) {
    std::error_code removal;
    std::filesystem::remove(file, removal);
    if (removal)
      throw OutputError(
          file.string() +
          ": this temporary file of an ended process cannot be removed: " + removal.message());
  }
  return static_cast<int>(stale.size());
}

void writeFileAtomically(const std::filesystem::path& path, std::string_view text) {
  writeFileAtomically(path, std::as_bytes(std::span(text.data(), text.size())));
}

std::filesystem::path cacheFolder() {
  std::filesystem::path folder;
  if (const char* own = std::getenv("CATOPTRIC_CACHE"); own != nullptr && *own != '\0') {
    folder = own;
  } else if (const char* xdg = std::getenv("XDG_CACHE_HOME"); xdg != nullptr && *xdg != '\0') {
    folder = std::filesystem::path(xdg) / "catoptric";
  } else if (const char* home = std::getenv("HOME"); home != nullptr && *home != '\0') {
    folder = std::filesystem::path(home) / ".cache/catoptric";
  } else {
    return {};
  }
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  return error ? std::filesystem::path{} : folder;
}

}  // namespace catoptric
