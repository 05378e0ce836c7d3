#include "cluster/submission.h"

#include <algorithm>
#include <array>
#include <set>

#include "cluster/job_scripts.h"
#include "config/json.h"
#include "config/json_text.h"
#include "core/error.h"
#include "core/file.h"
#include "core/text.h"
#include "scene/camera.h"

namespace catoptric::cluster {
namespace {

namespace fs = std::filesystem;
using config::JsonText;
using config::Value;

constexpr int kMaxFrame = 10'000'000;  ///< of a list of frames, or of chunks
constexpr std::size_t kMaxBytes = std::size_t{1} << 30;
constexpr const char* kDescription = "submission.json";
constexpr const char* kJobs = "jobs.jsonl";
constexpr const char* kParts = "parts";
constexpr const char* kLogs = "logs";

std::string numbersText(const std::vector<int>& numbers) {
  return numbers.empty() ? "" : scene::formatFrames(numbers);
}

std::vector<int> parseNumbers(const std::string& text) {
  return text.empty() ? std::vector<int>() : scene::parseFrames(text, kMaxFrame);
}

std::vector<std::string> strings(const Value& value) {
  std::vector<std::string> texts;
  for (const Value& item : value.asArray()) texts.push_back(item.asString());
  return texts;
}

std::string descriptionText(const Submission& submission) {
  std::vector<std::string> methods;
  for (const MethodShare& method : submission.methods) {
    std::vector<std::string> chunks;
    for (const std::vector<int>& frames : method.chunks) chunks.push_back(numbersText(frames));
    methods.push_back(JsonText()
                          .add("name", method.name)
                          .add("folder", method.folder)
                          .add("chunks", chunks)
                          .object());
  }
  return JsonText()
      .add("engine", submission.engine == Engine::Slurm ? "slurm" : "script")
      .add("program", submission.program)
      .add("working_folder", submission.workingFolder)
      .add("render", submission.runArguments)
      .add("study", submission.study)
      .add("sbatch", submission.slurmArguments)
      .add("max_parallel", submission.maxParallel)
      .add("chunks", submission.chunks)
      .raw("methods", "[" + joined(methods, ",\n") + "]")
      .object();
}

std::string jobLine(const Job& job) {
  return JsonText()
             .add("id", job.id)
             .add("offset", job.offset)
             .add("chunks", numbersText(job.chunks))
             .object() +
         "\n";
}

std::vector<Job> readJobs(const fs::path& file) {
  std::vector<Job> jobs;
  std::error_code error;
  if (!fs::exists(file, error)) return jobs;
  const std::string text = readTextFile(file);
  for (std::size_t start = 0; start < text.size();) {
    const std::size_t end = std::min(text.find('\n', start), text.size());
    const Value line = config::parseText(text.substr(start, end - start), file.string());
    jobs.push_back({line.get("id").asString(), static_cast<int>(line.get("offset").asInteger()),
                    parseNumbers(line.get("chunks").asString())});
    start = end + 1;
  }
  return jobs;
}

}  // namespace

Engine parseEngine(const std::string& text) {
  if (text == "slurm") return Engine::Slurm;
  if (text == "script") return Engine::Script;
  const std::array<std::string, 2> allowed = {"slurm", "script"};
  throw UsageError("--to: \"" + text + "\" is not allowed" + didYouMean(text, allowed) +
                   "; allowed: " + joined(allowed, ", "));
}

fs::path Submission::log(int chunk) const {
  return folder / "logs" / (std::to_string(chunk) + ".log");
}

std::vector<int> Submission::wanted() const {
  if (isStudy()) return {1};
  std::set<int> numbers;
  for (const MethodShare& method : methods)
    for (std::size_t i = 0; i < method.chunks.size(); ++i)
      if (!method.chunks[i].empty()) numbers.insert(static_cast<int>(i) + 1);
  return {numbers.begin(), numbers.end()};
}

bool isSubmission(const fs::path& folder) {
  std::error_code error;
  return fs::exists(folder / kDescription, error);
}

/// Whether a folder is empty, or has no more than a createSubmission() that was killed.
bool isUnused(const Submission& submission) {
  const fs::path& folder = submission.folder;
  if (!fs::is_directory(folder)) return !fs::exists(folder);
  if (fs::is_empty(folder)) return true;
  sweepTemporaryFiles(folder);
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const fs::path name = entry.path().filename();
    const bool begins = name == kParts || name == kLogs;
    if (entry.path() != submission.config() && !isScript(name) &&
        !(begins && entry.is_directory() && fs::is_empty(entry)))
      return false;
  }
  return fs::exists(folder / kParts);  // which is made first
}

void createSubmission(const Submission& submission, const std::string& config) {
  const fs::path& folder = submission.folder;
  try {
    if (!isUnused(submission))
      throw OutputError(folder.string() +
                        ": is not an empty folder; choose another --out, or continue that "
                        "submission by `catoptric retry`");
    for (const char* name : {kParts, kLogs}) fs::create_directories(folder / name);
  } catch (const fs::filesystem_error& failure) {
    throw OutputError(folder.string() + ": " + failure.what());
  }
  writeFileAtomically(submission.config(), config + "\n");
  writeScripts(submission);
  // Last: the folder is a submission when this is there
  writeFileAtomically(folder / kDescription, descriptionText(submission) + "\n");
}

Submission readSubmission(const fs::path& folder) {
  if (!isSubmission(folder))
    throw UsageError(folder.string() + ": is not the folder of a submission (it has no " +
                     kDescription + "); give the --out of a `catoptric submit`");
  const fs::path file = folder / kDescription;
  const Value value = config::parseText(readTextFile(file, kMaxBytes), file.string());
  Submission submission;
  submission.folder = fs::absolute(folder).lexically_normal();
  if (!submission.folder.has_filename()) submission.folder = submission.folder.parent_path();
  submission.engine = parseEngine(value.get("engine").asString());
  submission.program = value.get("program").asString();
  submission.workingFolder = value.get("working_folder").asString();
  submission.runArguments = strings(value.get("render"));
  submission.study = strings(value.get("study"));
  submission.slurmArguments = strings(value.get("sbatch"));
  submission.maxParallel = static_cast<int>(value.get("max_parallel").asInteger());
  submission.chunks = static_cast<int>(value.get("chunks").asInteger());
  for (const Value& method : value.get("methods").asArray()) {
    MethodShare share{method.get("name").asString(), method.get("folder").asString(), {}};
    for (const std::string& frames : strings(method.get("chunks")))
      share.chunks.push_back(parseNumbers(frames));
    submission.methods.push_back(std::move(share));
  }
  submission.jobs = readJobs(folder / kJobs);
  return submission;
}

void recordJob(Submission& submission, const Job& job) {
  submission.jobs.push_back(job);
  std::string text;
  for (const Job& known : submission.jobs) text += jobLine(known);
  writeFileAtomically(submission.folder / kJobs, text);
}

}  // namespace catoptric::cluster
