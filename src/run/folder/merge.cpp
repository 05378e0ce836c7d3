#include "run/folder/merge.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <set>

#include "config/json.h"
#include "config/json_text.h"
#include "core/error.h"
#include "core/log.h"
#include "core/text.h"
#include "scene/camera.h"

namespace catoptric::run {
namespace {

namespace fs = std::filesystem;
using config::JsonText;
using config::Value;

constexpr int kMaxFrame = 10'000'000;  ///< of a sequence's list of frames

/// One run folder of one method.
struct Part {
  fs::path path;
  RunRecords records;
  Value summary;         ///< null when it has none
  std::string sequence;  ///< frames of the undivided run, such as "1-100"; empty when unknown
};

bool isRun(const fs::path& path) {
  std::error_code error;
  return fs::exists(path / "frames.jsonl", error) || fs::exists(path / "summary.json", error);
}

/// Fails while a process writes there.
void checkUnused(const fs::path& path) {
  const int file = ::open((path / ".lock").c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return;  // copied without its lock, or from elsewhere
  const bool busy = ::flock(file, LOCK_SH | LOCK_NB) != 0 && errno == EWOULDBLOCK;
  ::close(file);
  if (busy)
    throw UsageError(path.string() +
                     ": a process is still writing this run; wait until it has ended");
}

Part readPart(const fs::path& path) {
  checkUnused(path);
  Part part;
  part.path = path;
  part.records = readRunRecords(path);
  std::error_code error;
  if (fs::exists(path / "summary.json", error)) {
    part.summary = config::parseFile(path / "summary.json");
    if (part.summary.has("sequence"))
      part.sequence = part.summary.get("sequence").get("frames").asString();
  }
  return part;
}

/// Method folders by name; "" for a run of one method.
std::map<std::string, Part> partsOf(const fs::path& run) {
  std::error_code error;
  if (!fs::is_directory(run, error)) throw UsageError(run.string() + ": no such folder");
  std::map<std::string, Part> parts;
  if (isRun(run)) {
    parts.emplace("", readPart(run));
    return parts;
  }
  for (const fs::directory_entry& entry : fs::directory_iterator(run, error))
    if (entry.is_directory(error) && isRun(entry.path()))
      parts.emplace(entry.path().filename().string(), readPart(entry.path()));
  if (parts.empty())
    throw UsageError(run.string() + ": not a run (neither it nor a folder in it has frames.jsonl)");
  return parts;
}

std::string differences(const FrameRecord& a, const FrameRecord& b) {
  std::vector<std::string> texts;
  if (a.fingerprints.config != b.fingerprints.config) texts.push_back("method or image settings");
  if (a.fingerprints.scene != b.fingerprints.scene) texts.push_back("scene");
  if (a.fingerprints.build != b.fingerprints.build) texts.push_back("program");
  if (!sameRenderer(a.origin.renderer, b.origin.renderer)) texts.push_back("renderer");
  return joined(texts, ", another ");
}

/// What is to be merged of one method: for each frame its record and the run that has it.
struct Merge {
  std::vector<Part> parts;  ///< by first frame, so that the order of the runs does not matter
  std::map<int, const Part*> owner;

  Origins origins() const {
    Origins all;
    for (const auto& [number, part] : owner)
      all.add(part->records.frames.at(number).origin, number);
    return all;
  }
};

class Problems {
 public:
  void mismatch(const std::string& text) { mismatches_.push_back(text); }
  void missing(const std::string& text) { missing_.push_back(text); }
  void raise() const {
    std::vector<std::string> all = mismatches_;
    all.insert(all.end(), missing_.begin(), missing_.end());
    if (!mismatches_.empty()) throw UsageError(joined(all, "\n"));
    if (!missing_.empty()) throw Error(ExitCode::FramesFailed, joined(all, "\n"));
  }

 private:
  std::vector<std::string> mismatches_;
  std::vector<std::string> missing_;
};

void check(const std::string& method, Merge& merge, Problems& problems) {
  const std::string prefix = method.empty() ? "" : method + ": ";
  const Part* first = nullptr;
  std::string sequence;
  const Part* sequenceOf = nullptr;
  for (const Part& part : merge.parts) {
    if (!part.sequence.empty() && sequenceOf == nullptr) {
      sequenceOf = &part;
      sequence = part.sequence;
    } else if (!part.sequence.empty() && part.sequence != sequence) {
      problems.mismatch(part.path.string() + ": belongs to a run of frames " + part.sequence +
                        ", " + sequenceOf->path.string() + " to a run of frames " + sequence);
    }
    std::map<std::string, std::vector<int>> foreign;
    std::vector<int> conflicts;
    for (const auto& [number, record] : part.records.frames) {
      if (first == nullptr) first = &part;
      const std::string other = differences(record, first->records.frames.begin()->second);
      if (!other.empty()) {
        foreign[other].push_back(number);
        continue;
      }
      if (!staysInside(record)) {
        problems.mismatch(part.path.string() + ": the record of frame " + std::to_string(number) +
                          " names a file outside its folder");
        continue;
      }
      if (const std::string why = damage(part.path, record); !why.empty()) {
        problems.missing(part.path.string() + ": frame " + std::to_string(number) + ": " + why);
        continue;
      }
      const auto [place, fresh] = merge.owner.emplace(number, &part);
      if (fresh) continue;
      // The same frame twice does no harm where it is the same.
      const FrameRecord& known = place->second->records.frames.at(number);
      const bool same =
          known.fingerprints.camera == record.fingerprints.camera &&
          std::equal(known.files.begin(), known.files.end(), record.files.begin(),
                     record.files.end(), [](const FileRecord& a, const FileRecord& b) {
                       return a.path == b.path && a.content == b.content && a.bytes == b.bytes;
                     });
      if (!same) conflicts.push_back(number);
    }
    for (const auto& [what, numbers] : foreign)
      problems.mismatch(part.path.string() + ": frames " + scene::formatFrames(numbers) +
                        " differ in " + what + " from those of " + first->path.string());
    if (!conflicts.empty())
      problems.mismatch(part.path.string() + ": frames " + scene::formatFrames(conflicts) +
                        " are also in another part, with different contents");
  }
  if (sequenceOf == nullptr) {
    problems.mismatch(prefix + "no part says which frames the run has (summary.json, sequence)");
    return;
  }
  std::vector<int> wanted = scene::parseFrames(sequence, kMaxFrame);
  std::vector<int> gaps;
  std::vector<int> strangers;
  for (const int number : wanted)
    if (merge.owner.count(number) == 0) gaps.push_back(number);
  for (const auto& [number, part] : merge.owner)
    if (!std::binary_search(wanted.begin(), wanted.end(), number)) strangers.push_back(number);
  if (!gaps.empty())
    problems.missing(prefix + "frames " + scene::formatFrames(gaps) +
                     " are in no run; render them with --frames " + scene::formatFrames(gaps));
  if (!strangers.empty())
    problems.mismatch(prefix + "frames " + scene::formatFrames(strangers) +
                      " are not among the frames of the run, " + sequence);
}

/// Members of a run's summary that all parts share, and what the whole consists of.
std::map<std::string, std::string> summaryOf(const Merge& merge) {
  std::map<std::string, std::string> members;
  double seconds = 0.0;
  std::vector<std::string> origins;
  for (const Part& part : merge.parts) {
    std::vector<int> own;
    for (const auto& [number, owner] : merge.owner)
      if (owner == &part) own.push_back(number);
    origins.push_back(JsonText()
                          .add("run", part.path.filename().string())
                          .add("frames", own.empty() ? "" : scene::formatFrames(own))
                          .object());
    if (part.summary.isNull()) continue;
    for (const char* name : {"config", "method", "machine", "step_kinds", "keeps", "path_frames",
                             "reflectors", "plan", "device"})
      if (members.count(name) == 0 && part.summary.has(name))
        members[name] = part.summary.get(name).dump();
    const Value status = part.summary.get("status");
    if (!status.isNull() && status.has("seconds")) seconds += status.get("seconds").asNumber();
    if (!part.sequence.empty())
      members["sequence"] =
          JsonText().add("frames", part.sequence).add("chunk", 1).add("chunks", 1).object();
  }
  members["merged"] = "[" + joined(origins, ",") + "]";
  members["machines"] = merge.origins().json();
  members["status"] = JsonText()
                          .add("rendered", static_cast<int>(merge.owner.size()))
                          .add("reused", 0)
                          .add("failed", std::vector<int>())
                          .add("missing", std::vector<int>())
                          .add("stopped", false)
                          .add("seconds", seconds)
                          .object();
  return members;
}

/// Names of the methods as a part's config lists them; none when unknown.
std::vector<std::string> configuredOrder(const Merge& merge) {
  std::vector<std::string> names;
  for (const Part& part : merge.parts) {
    if (!names.empty() || part.summary.isNull() || !part.summary.has("config")) continue;
    const Value methods = part.summary.get("config").get("methods");
    if (methods.kind() != Value::Kind::Array) continue;
    for (const Value& method : methods.asArray())
      if (method.has("name")) names.push_back(method.get("name").asString());
  }
  return names;
}

MergedRun write(const std::string& method, const Merge& merge, const fs::path& path,
                Existing existing) {
  RunFolder folder(path, existing);
  folder.begin();
  merge.origins().warn(path.string());
  std::vector<FrameRecord> records;
  MergedRun merged;
  for (const auto& [number, part] : merge.owner) {
    const FrameRecord& record = part->records.frames.at(number);
    for (const FileRecord& file : record.files) folder.takeFile(file.path, part->path / file.path);
    // A copy is read back; a source may have changed since it was checked.
    if (const std::string why = damage(path, record); !why.empty())
      throw OutputError(path.string() + ": frame " + std::to_string(number) + ": " + why);
    records.push_back(record);
    merged.frames.push_back(number);
  }
  folder.add(std::move(records));
  for (const Part& part : merge.parts) folder.addStartup(part.records.startup);
  folder.writeTimings();
  const std::map<std::string, std::string> members = summaryOf(merge);
  folder.writeSummary(members);
  merged.folder = path;
  merged.config = members.count("config") != 0 ? members.at("config") : "{}";
  merged.name = method;
  if (method.empty() && members.count("method") != 0)
    merged.name = config::parseText(members.at("method"), "summary").get("name").asString();
  return merged;
}

}  // namespace

std::vector<MergedRun> mergeRuns(const std::vector<fs::path>& runs, const fs::path& out,
                                 Existing existing) {
  if (existing == Existing::Resume)
    throw UsageError("--existing resume: merge cannot resume; use error or overwrite");
  std::map<std::string, Merge> merges;
  std::set<fs::path> seen;
  for (const fs::path& run : runs) {
    std::error_code error;
    const fs::path canonical = fs::weakly_canonical(run, error);
    if (!seen.insert(canonical).second) throw UsageError(run.string() + ": is named twice");
    const fs::path whole = fs::weakly_canonical(out, error);
    if (std::mismatch(canonical.begin(), canonical.end(), whole.begin(), whole.end()).first ==
        canonical.end())
      throw UsageError(run.string() + (canonical == whole ? ": is --out itself"
                                                          : ": --out is inside this part; choose "
                                                            "a folder outside of all parts"));
    for (auto& [method, part] : partsOf(run)) merges[method].parts.push_back(std::move(part));
  }

  Problems problems;
  for (auto& [method, merge] : merges) {
    const auto firstFrame = [](const Part& part) {
      return part.records.frames.empty() ? 0 : part.records.frames.begin()->first;
    };
    std::sort(merge.parts.begin(), merge.parts.end(), [&](const Part& a, const Part& b) {
      return std::pair(firstFrame(a), a.path.filename()) <
             std::pair(firstFrame(b), b.path.filename());
    });
    check(method, merge, problems);
  }
  if (merges.size() > 1 && merges.count("") != 0)
    problems.mismatch("some runs have a folder per method, others have not");
  problems.raise();

  // In the order of the run's config.
  std::vector<std::string> order;
  for (const auto& [method, merge] : merges) order.push_back(method);
  const std::vector<std::string> configured = configuredOrder(merges.begin()->second);
  std::stable_sort(order.begin(), order.end(), [&](const std::string& a, const std::string& b) {
    return std::find(configured.begin(), configured.end(), a) <
           std::find(configured.begin(), configured.end(), b);
  });
  std::vector<MergedRun> merged;
  if (!order.front().empty()) checkFolderOfRuns(out, order);
  for (const std::string& method : order)
    merged.push_back(
        write(method, merges.at(method), method.empty() ? out : out / method, existing));
  return merged;
}

}  // namespace catoptric::run
