// A worker in a process of its own: this program, or another build of it.
#pragma once

#include <sys/types.h>

#include <exception>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "study/engine.h"

namespace catoptric::study {

/// Thrown if the study was asked to stop.
struct StudyStopped : std::exception {
  const char* what() const noexcept override { return "the study was asked to stop"; }
};

/// How long a worker may give no answer.
struct Patience {
  double seconds = 1800.0;              ///< after this it is killed, which is an Error
  std::function<bool()> stopRequested;  ///< asked while a worker gives no answer; may be empty
};

class WorkerProcess : public Runner {
 public:
  /// Starts `program` with "worker" and `arguments`, and waits until it can render. Its stderr goes
  /// to the file `log`. Throws Error with its last messages if it cannot render; StudyStopped, here
  /// and in render(), if a stop was requested and the worker gives no answer for two more seconds.
  WorkerProcess(const std::filesystem::path& program, const std::vector<std::string>& arguments,
                const std::filesystem::path& log, Patience patience);
  ~WorkerProcess() override { end(); }
  WorkerProcess(const WorkerProcess&) = delete;
  WorkerProcess& operator=(const WorkerProcess&) = delete;

  FrameReport render(int frame, const std::filesystem::path& writeTo) override;
  /// nullopt if the worker is an older build, which does not say what it builds.
  std::optional<FrameReport> first(int frame, bool again) override;

  const std::string& renderer() const { return renderer_; }
  const std::string& build() const { return build_; }
  /// Throws InputChanged if it is a process of this build and has read other contents than
  /// `inputs`, an InputFiles::print(): a file has changed, perhaps back meanwhile.
  void requireInputs(const std::string& inputs) const;
  /// Seconds before the first frame, by name: "start" is the sum of all steps, "start.bake" one
  /// step. Older builds report the sum only.
  const std::map<std::string, double>& startup() const { return startup_; }
  std::uint64_t memoryBytes() const { return memoryBytes_; }  ///< peak value so far

 private:
  void start();
  void end();
  FrameReport ask(int frame, const std::string& order);
  void waitForAnswer();
  std::string readLine();
  [[noreturn]] void failEnded();

  std::filesystem::path program_;
  std::vector<std::string> arguments_;
  std::filesystem::path log_;
  Patience patience_;
  pid_t pid_ = -1;
  int toWorker_ = -1;
  int fromWorker_ = -1;
  std::string buffered_;
  std::string renderer_;
  std::string build_;
  std::string inputs_;  ///< empty: of an older build, which does not say it
  std::map<std::string, double> startup_;
  std::optional<FrameReport> builds_;  ///< what is built before the first frame
  std::optional<FrameReport> first_;   ///< what first() has measured last
  bool rendered_ = false;
  std::uint64_t memoryBytes_ = 0;
};

/// The file of the running program.
std::filesystem::path ownProgram();

}  // namespace catoptric::study
