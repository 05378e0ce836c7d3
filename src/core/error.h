// Typed errors of input, files and drivers. Libraries throw them and never exit; main maps them to
// the exit codes of the command line. Bugs of the program are assertions, not errors.
#pragma once

#include <new>
#include <stdexcept>
#include <string>

namespace catoptric {

enum class ExitCode : int {
  Done = 0,
  Usage = 2,           ///< wrong usage or config
  Scene = 3,           ///< wrong scene or asset
  NoDevice = 4,        ///< no GL device
  Output = 5,          ///< output could not be written
  FramesFailed = 6,    ///< some frames failed; their list is printed
  LimitsExceeded = 7,  ///< a comparison exceeded its limits
  OutOfMemory = 8,     ///< not enough memory
  Internal = 70,       ///< a bug of the program
};

/// Base class of all errors that a user can cause or fix. what() is a complete message: it names
/// the place, the value, and what to do.
class Error : public std::runtime_error {
 public:
  Error(ExitCode code, const std::string& message) : std::runtime_error(message), code_(code) {}
  ExitCode code() const { return code_; }

 private:
  ExitCode code_;
};

struct UsageError : Error {
  explicit UsageError(const std::string& m) : Error(ExitCode::Usage, m) {}
};
struct SceneError : Error {
  explicit SceneError(const std::string& m) : Error(ExitCode::Scene, m) {}
};
struct DeviceError : Error {
  explicit DeviceError(const std::string& m) : Error(ExitCode::NoDevice, m) {}
};
/// A frame that cannot be written as it was rendered; other frames of the run may be valid.
struct FrameError : Error {
  explicit FrameError(const std::string& m) : Error(ExitCode::FramesFailed, m) {}
};
struct OutputError : Error {
  explicit OutputError(const std::string& m) : Error(ExitCode::Output, m) {}
};

inline bool isOutOfMemory(const std::exception& error) {
  const auto* const ours = dynamic_cast<const Error*>(&error);
  return ours != nullptr ? ours->code() == ExitCode::OutOfMemory
                         : dynamic_cast<const std::bad_alloc*>(&error) != nullptr;
}

/// what() of an exception; for std::bad_alloc a plain message.
inline std::string messageOf(const std::exception& error) {
  return dynamic_cast<const std::bad_alloc*>(&error) != nullptr ? "out of memory" : error.what();
}

}  // namespace catoptric
