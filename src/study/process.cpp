#include "study/process.h"

#include <fcntl.h>
#include <fmt/core.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <fstream>

#include "config/json.h"
#include "config/json_text.h"
#include "core/clock.h"
#include "core/error.h"
#include "core/input_files.h"
#include "run/folder/machine.h"

extern char** environ;

namespace catoptric::study {
namespace {

namespace fs = std::filesystem;

/// How long workers go on after a stop was requested, or their input was closed (our choice).
constexpr double kGraceSeconds = 2.0;

/// Both ends are closed in children but where they are handed over.
std::array<int, 2> makePipe() {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0)
    throw Error(ExitCode::OutOfMemory,
                std::string("no pipe to a worker can be created: ") + std::strerror(errno));
  return ends;
}

/// All lines of the last error in a worker's log, without its level; else the last line.
std::string lastWords(const fs::path& log) {
  constexpr std::string_view kLevel = "error: ";
  std::ifstream file(log);
  std::string last;
  bool isError = false;
  for (std::string line; std::getline(file, line);) {
    if (line.empty()) continue;
    const bool begins = line.starts_with(kLevel);
    if (begins) line.erase(0, kLevel.size());
    last = isError && !begins ? last + "\n" + line : line;
    isError = isError || begins;
  }
  return last;
}

std::map<std::string, double> numbersOf(const config::Value& object) {
  std::map<std::string, double> numbers;
  if (!object.isNull())
    for (const std::string& name : object.keys()) numbers[name] = object.get(name).asNumber();
  return numbers;
}

}  // namespace

WorkerProcess::WorkerProcess(const fs::path& program, const std::vector<std::string>& arguments,
                             const fs::path& log, Patience patience)
    : program_(program), arguments_(arguments), log_(log), patience_(std::move(patience)) {
  start();
}

void WorkerProcess::start() {
  const std::array<int, 2> in = makePipe();
  const std::array<int, 2> out = makePipe();
  std::vector<std::string> words{program_.string(), "worker"};
  words.insert(words.end(), arguments_.begin(), arguments_.end());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);

  fs::create_directories(log_.parent_path());
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, in[0], STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, out[1], STDOUT_FILENO);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, log_.c_str(),
                                   O_WRONLY | O_CREAT | O_TRUNC, 0644);
  // A group of its own: Ctrl-C is for this program, which ends its workers by closing their input.
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  const int error =
      ::posix_spawn(&pid_, program_.c_str(), &actions, &attributes, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  posix_spawnattr_destroy(&attributes);
  ::close(in[0]);
  ::close(out[1]);
  toWorker_ = in[1];
  fromWorker_ = out[0];
  if (error != 0) {
    ::close(toWorker_);
    ::close(fromWorker_);
    pid_ = toWorker_ = fromWorker_ = -1;
    const std::string message = program_.string() + ": cannot be started: " + std::strerror(error);
    if (error == EAGAIN || error == ENOMEM) throw Error(ExitCode::OutOfMemory, message);
    throw UsageError(message);
  }
  try {
    const config::Value ready = config::parseText(readLine(), program_.string());
    renderer_ = ready.get("renderer").asString();
    build_ = ready.get("build").asString();
    if (ready.has("inputs")) inputs_ = ready.get("inputs").asString();
    if (ready.has("startup"))
      for (const auto& [step, seconds] : numbersOf(ready.get("startup")))
        startup_["start." + step] = seconds;
    startup_["start"] = ready.get("startup_seconds").asNumber();
    memoryBytes_ = static_cast<std::uint64_t>(ready.get("memory_bytes").asNumber());
    builds_.reset();
    if (ready.has("builds")) {
      builds_.emplace();
      builds_->seconds = ready.get("builds").get("seconds").asNumber();
      builds_->cpuSeconds = ready.get("builds").get("cpu_seconds").asNumber();
    }
  } catch (...) {
    end();
    throw;
  }
}

void WorkerProcess::requireInputs(const std::string& inputs) const {
  if (build_ == run::buildFingerprint() && inputs_ != inputs) throw InputChanged("an input file");
}

void WorkerProcess::end() {
  if (pid_ < 0) return;
  ::close(toWorker_);
  ::close(fromWorker_);
  // A worker whose input is closed ends by itself; one that is stopped or hangs is killed.
  const std::int64_t start = nowNs();
  int status = 0;
  for (;;) {
    const pid_t ended = ::waitpid(pid_, &status, WNOHANG);
    if (ended == pid_ || (ended < 0 && errno != EINTR)) break;
    if (secondsSince(start) > kGraceSeconds) ::kill(pid_, SIGKILL);
    ::poll(nullptr, 0, 2);
  }
  pid_ = toWorker_ = fromWorker_ = -1;
  buffered_.clear();
}

void WorkerProcess::failEnded() {
  const std::string words = lastWords(log_);
  throw Error(ExitCode::FramesFailed,
              words.empty() ? program_.string() + " worker ended without a message" : words);
}

/// Until there is something to read.
void WorkerProcess::waitForAnswer() {
  const std::int64_t start = nowNs();
  std::int64_t stopped = 0;
  for (;;) {
    pollfd place{fromWorker_, POLLIN, 0};
    if (::poll(&place, 1, 100) > 0) return;
    if (stopped == 0 && patience_.stopRequested && patience_.stopRequested()) stopped = nowNs();
    if (stopped != 0 && secondsSince(stopped) > kGraceSeconds) {
      ::kill(pid_, SIGKILL);
      throw StudyStopped();
    }
    if (secondsSince(start) < patience_.seconds) continue;
    ::kill(pid_, SIGKILL);
    throw Error(ExitCode::FramesFailed, fmt::format("{} did not answer for {:g} s and was killed",
                                                    program_.string(), patience_.seconds));
  }
}

std::string WorkerProcess::readLine() {
  for (;;) {
    const std::size_t end = buffered_.find('\n');
    if (end != std::string::npos) {
      std::string line = buffered_.substr(0, end);
      buffered_.erase(0, end + 1);
      return line;
    }
    waitForAnswer();
    std::array<char, 65536> bytes{};
    const ssize_t count = ::read(fromWorker_, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) failEnded();
    buffered_.append(bytes.data(), static_cast<std::size_t>(count));
  }
}

FrameReport WorkerProcess::render(int frame, const fs::path& writeTo) {
  config::JsonText order;
  order.add("frame", frame);
  if (!writeTo.empty()) order.add("write", writeTo.string());
  return ask(frame, order.object() + "\n");
}

std::optional<FrameReport> WorkerProcess::first(int frame, bool again) {
  if (!builds_ || (first_ && !again)) return first_;
  if (std::exchange(rendered_, false)) {
    const std::string inputs = inputs_;
    end();
    start();
    requireInputs(inputs);
  }
  FrameReport report =
      ask(frame, config::JsonText().add("frame", frame).add("first", true).object() + "\n");
  report.seconds += builds_->seconds;
  report.cpuSeconds += builds_->cpuSeconds;
  first_ = std::move(report);
  return first_;
}

FrameReport WorkerProcess::ask(int frame, const std::string& text) {
  rendered_ = true;
  for (std::size_t sent = 0; sent < text.size();) {
    const ssize_t count = ::write(toWorker_, text.data() + sent, text.size() - sent);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) failEnded();
    sent += static_cast<std::size_t>(count);
  }
  const config::Value answer = config::parseText(readLine(), program_.string());
  if (answer.has("failed"))
    throw Error(ExitCode::FramesFailed,
                "frame " + std::to_string(frame) + ": " + answer.get("failed").asString());
  FrameReport report;
  report.seconds = answer.get("seconds").asNumber();
  report.cpuSeconds = answer.get("cpu_seconds").asNumber();
  report.steps = numbersOf(answer.get("steps"));
  for (const auto& [name, count] : numbersOf(answer.get("counters")))
    report.counters[name] = static_cast<std::uint64_t>(count);
  if (answer.has("pixels")) report.pixels = answer.get("pixels").asString();
  if (answer.has("memory_bytes"))
    report.memoryBytes = memoryBytes_ =
        static_cast<std::uint64_t>(answer.get("memory_bytes").asNumber());
  return report;
}

fs::path ownProgram() {
  return fs::read_symlink("/proc/self/exe");
}

}  // namespace catoptric::study
