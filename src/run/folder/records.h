// Records of a run's frames, a line of frames.jsonl each. A record is written after its frame's
// files, and states their fingerprints: what has no matching record does not count.
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

/// What a frame's pixels depend on, each as 16 hexadecimal digits or plain text.
struct FrameFingerprints {
  std::string config;  ///< method, options, image settings, seed
  std::string scene;   ///< all contents of the scene
  std::string camera;  ///< camera and time of this frame (and of earlier ones it depends on)
  std::string build;   ///< the program
};

struct FileRecord {
  std::string path;  ///< relative to the run's folder
  std::uint64_t bytes = 0;
  std::string content;  ///< fingerprint of the bytes
};

/// One line of frames.jsonl.
struct FrameRecord {
  int frame = 0;
  double timeSeconds = 0.0;  ///< of the scene
  FrameFingerprints fingerprints;
  FrameOrigin origin;
  std::vector<FileRecord> files;
  std::map<std::string, std::uint64_t> counters;
  std::vector<methods::Table> tables;  ///< that have rows
  std::vector<frame::StepSample> samples;
};

std::string recordLine(const FrameRecord& record);
/// Throws UsageError with the place.
FrameRecord parseRecord(const std::string& line, const std::string& place);

/// What the records and the table of a run's folder say; lines that cannot be read are warned of
/// and left out.
struct RunRecords {
  std::map<int, FrameRecord> frames;
  std::vector<frame::StepSample> startup;
};
RunRecords readRunRecords(const std::filesystem::path& path);

/// Why the files of `record` in `folder` are not what was written; empty when they are.
std::string damage(const std::filesystem::path& folder, const FrameRecord& record);

/// "frames/frame.0001.exr" for ("frames", 1, ".exr").
std::string framePath(const std::string& folder, int frame, const std::string& extension);

}  // namespace catoptric::run
