// The records of a run's frames, one line of frames.jsonl each. A record is written after its
// frame's files and contains their fingerprints. Files without a matching record are ignored.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "frame/steps.h"
#include "methods/contract/table.h"
#include "run/folder/origin.h"

namespace catoptric::run {

/// What a frame's pixels depend on; each as 16 hexadecimal digits or plain text.
struct FrameFingerprints {
  std::string config;  ///< method, options, image settings, seed
  std::string scene;   ///< all contents of the scene
  std::string camera;  ///< camera and time of this frame, and of the earlier frames it depends on
  std::string build;   ///< the program
};

struct FileRecord {
  std::string path;  ///< relative to the run's folder
  std::uint64_t bytes = 0;
  std::string content;  ///< fingerprint of the file's bytes
};

/// The contents of one line of frames.jsonl.
struct FrameRecord {
  int frame = 0;
  double timeSeconds = 0.0;  ///< time in the scene
  FrameFingerprints fingerprints;
  FrameOrigin origin;
  std::vector<FileRecord> files;
  std::map<std::string, std::uint64_t> counters;
  std::vector<methods::Table> tables;  ///< only tables with rows
  std::vector<frame::StepSample> samples;
};

std::string recordLine(const FrameRecord& record);
/// Throws UsageError with the place.
FrameRecord parseRecord(const std::string& line, const std::string& place);

/// The records and the step times in a run's folder. Unreadable lines are left out, with a warning.
struct RunRecords {
  std::map<int, FrameRecord> frames;
  std::vector<frame::StepSample> startup;
};
RunRecords readRunRecords(const std::filesystem::path& path);

/// Whether the files of `record` are ordinary names below its run's folder.
bool staysInside(const FrameRecord& record);

/// Why the files of `record` in `folder` differ from what was written; empty if they do not.
std::string damage(const std::filesystem::path& folder, const FrameRecord& record);

/// For example "frames/frame.0001.exr" for ("frames", 1, ".exr").
std::string framePath(const std::string& folder, int frame, const std::string& extension);

}  // namespace catoptric::run
