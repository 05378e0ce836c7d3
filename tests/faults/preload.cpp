// A library for LD_PRELOAD that lets calls of the program fail: allocations, OpenGL, writes, new
// folders and files, new processes, locks of SQLite. All processes of a command count in the file
// that CATOPTRIC_FAULTS names (struct Shared; tests/faults/run.py writes and reads it), and the
// call of the chosen kind with the chosen number fails.
#include <dlfcn.h>
#include <fcntl.h>
#include <link.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <new>

namespace {

enum Kind : int { Memory, GlMemory, GlError, Write, Folder, Create, Process, Lock, Kinds };

struct Shared {
  std::int64_t kind;   ///< that fails
  std::int64_t first;  ///< the number of the call that fails, from 1; 0: none
  std::int64_t last;   ///< the last one that fails
  std::atomic<std::int64_t> calls[Kinds];
};

/// Null outside of the test's program, and before the library is ready.
Shared* shared = nullptr;
std::uintptr_t programBegins = 0;
std::uintptr_t programEnds = 0;

int findProgram(dl_phdr_info* info, std::size_t, void*) {
  for (int i = 0; i < info->dlpi_phnum; ++i) {
    const ElfW(Phdr)& part = info->dlpi_phdr[i];
    if (part.p_type != PT_LOAD || (part.p_flags & PF_X) == 0) continue;
    programBegins = info->dlpi_addr + part.p_vaddr;
    programEnds = programBegins + part.p_memsz;
  }
  return 1;  // the first object is the program
}

__attribute__((constructor)) void prepare() {
  const char* name = std::getenv("CATOPTRIC_FAULTS");
  if (name == nullptr) return;
  dl_iterate_phdr(findProgram, nullptr);
  const int file = ::open(name, O_RDWR | O_CLOEXEC);
  if (file < 0) return;
  void* memory = ::mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  ::close(file);
  if (memory != MAP_FAILED) shared = static_cast<Shared*>(memory);
}

bool fails(Kind kind) {
  if (shared == nullptr) return false;
  const std::int64_t number = shared->calls[kind].fetch_add(1) + 1;
  return shared->kind == kind && number >= shared->first && number <= shared->last;
}

/// Drivers and libraries may answer a failed allocation by ending the process.
bool ofProgram(const void* caller) {
  const auto at = reinterpret_cast<std::uintptr_t>(caller);
  return at >= programBegins && at < programEnds;
}

bool isFile(int descriptor) {
  struct stat found {};
  return ::fstat(descriptor, &found) == 0 && S_ISREG(found.st_mode);
}

int failWith(int error) {
  errno = error;
  return -1;
}

template <class Function>
Function next(const char* name) {
  static void* (*real)(void*, const char*) =
      reinterpret_cast<void* (*)(void*, const char*)>(dlvsym(RTLD_NEXT, "dlsym", "GLIBC_2.2.5"));
  return reinterpret_cast<Function>(real(RTLD_NEXT, name));
}

void* allocate(std::size_t bytes, std::size_t alignment, const void* caller) {
  if (ofProgram(caller) && fails(Memory)) throw std::bad_alloc();
  void* memory = nullptr;
  if (alignment == 0)
    memory = std::malloc(bytes != 0 ? bytes : 1);
  else if (::posix_memalign(&memory, alignment, bytes) != 0)
    memory = nullptr;
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

// ---- OpenGL: glGetError, which the program gets from EGL or OSMesa ----

using Lookup = void* (*)(const char*);
unsigned (*realGetError)() = nullptr;
Lookup realLookups[2] = {nullptr, nullptr};

unsigned faultyGetError() {
  constexpr unsigned kInvalidOperation = 0x0502;
  constexpr unsigned kOutOfMemory = 0x0505;
  if (fails(GlMemory)) return kOutOfMemory;
  if (fails(GlError)) return kInvalidOperation;
  return realGetError();
}

template <int Which>
void* lookUp(const char* name) {
  void* found = realLookups[Which](name);
  if (std::strcmp(name, "glGetError") != 0) return found;
  realGetError = reinterpret_cast<unsigned (*)()>(found);
  return reinterpret_cast<void*>(&faultyGetError);
}

}  // namespace

extern "C" {

void* dlsym(void* handle, const char* name) {
  static auto* real =
      reinterpret_cast<void* (*)(void*, const char*)>(dlvsym(RTLD_NEXT, "dlsym", "GLIBC_2.2.5"));
  void* found = real(handle, name);
  if (found == nullptr || shared == nullptr) return found;
  if (std::strcmp(name, "eglGetProcAddress") == 0) {
    realLookups[0] = reinterpret_cast<Lookup>(found);
    return reinterpret_cast<void*>(&lookUp<0>);
  }
  if (std::strcmp(name, "OSMesaGetProcAddress") == 0) {
    realLookups[1] = reinterpret_cast<Lookup>(found);
    return reinterpret_cast<void*>(&lookUp<1>);
  }
  return found;
}

ssize_t write(int file, const void* bytes, std::size_t count) {
  static auto* real = next<ssize_t (*)(int, const void*, std::size_t)>("write");
  return isFile(file) && fails(Write) ? failWith(ENOSPC) : real(file, bytes, count);
}

ssize_t pwrite64(int file, const void* bytes, std::size_t count, off64_t at) {
  static auto* real = next<ssize_t (*)(int, const void*, std::size_t, off64_t)>("pwrite64");
  return isFile(file) && fails(Write) ? failWith(ENOSPC) : real(file, bytes, count, at);
}

int fsync(int file) {
  static auto* real = next<int (*)(int)>("fsync");
  return fails(Write) ? failWith(EIO) : real(file);
}

int rename(const char* from, const char* to) {
  static auto* real = next<int (*)(const char*, const char*)>("rename");
  return fails(Write) ? failWith(EIO) : real(from, to);
}

int mkdir(const char* path, mode_t mode) {
  static auto* real = next<int (*)(const char*, mode_t)>("mkdir");
  return fails(Folder) ? failWith(ENOSPC) : real(path, mode);
}

#define CATOPTRIC_OPEN(name)                                               \
  int name(const char* path, int flags, ...) {                             \
    static auto* real = next<int (*)(const char*, int, ...)>(#name);       \
    std::va_list rest;                                                     \
    va_start(rest, flags);                                                 \
    const mode_t mode = (flags & O_CREAT) != 0 ? va_arg(rest, mode_t) : 0; \
    va_end(rest);                                                          \
    if ((flags & O_CREAT) != 0 && fails(Create)) return failWith(ENOSPC);  \
    return real(path, flags, mode);                                        \
  }
CATOPTRIC_OPEN(open)
CATOPTRIC_OPEN(open64)

#define CATOPTRIC_TEMPORARY(name)                                        \
  int name(char* path, int ending, int flags) {                          \
    static auto* real = next<int (*)(char*, int, int)>(#name);           \
    return fails(Create) ? failWith(ENOSPC) : real(path, ending, flags); \
  }
CATOPTRIC_TEMPORARY(mkostemps)
CATOPTRIC_TEMPORARY(mkostemps64)

pid_t fork() {
  static auto* real = next<pid_t (*)()>("fork");
  return fails(Process) ? failWith(EAGAIN) : real();
}

int posix_spawn(pid_t* child, const char* path, const posix_spawn_file_actions_t* actions,
                const posix_spawnattr_t* attributes, char* const arguments[],
                char* const environment[]) {
  static auto* real = next<decltype(&posix_spawn)>("posix_spawn");
  return fails(Process) ? EAGAIN : real(child, path, actions, attributes, arguments, environment);
}

int pipe2(int* ends, int flags) {
  static auto* real = next<int (*)(int*, int)>("pipe2");
  return fails(Process) ? failWith(EMFILE) : real(ends, flags);
}

#define CATOPTRIC_FCNTL(name)                                                                    \
  int name(int file, int command, ...) {                                                         \
    static auto* real = next<int (*)(int, int, ...)>(#name);                                     \
    std::va_list rest;                                                                           \
    va_start(rest, command);                                                                     \
    void* argument = va_arg(rest, void*);                                                        \
    va_end(rest);                                                                                \
    const bool locks = command == F_SETLK && static_cast<flock64*>(argument)->l_type != F_UNLCK; \
    if (locks && fails(Lock)) return failWith(EAGAIN);                                           \
    return real(file, command, argument);                                                        \
  }
CATOPTRIC_FCNTL(fcntl)
CATOPTRIC_FCNTL(fcntl64)

}  // extern "C"

void* operator new(std::size_t bytes) {
  return allocate(bytes, 0, __builtin_return_address(0));
}
void* operator new[](std::size_t bytes) {
  return allocate(bytes, 0, __builtin_return_address(0));
}
void* operator new(std::size_t bytes, std::align_val_t alignment) {
  return allocate(bytes, static_cast<std::size_t>(alignment), __builtin_return_address(0));
}
void* operator new[](std::size_t bytes, std::align_val_t alignment) {
  return allocate(bytes, static_cast<std::size_t>(alignment), __builtin_return_address(0));
}
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete[](void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}
void operator delete[](void* memory, std::size_t) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::align_val_t) noexcept {
  std::free(memory);
}
void operator delete[](void* memory, std::align_val_t) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept {
  std::free(memory);
}
void operator delete[](void* memory, std::size_t, std::align_val_t) noexcept {
  std::free(memory);
}
