// What a report reads of a run's folder: its frames, previews and step times.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "frame/steps.h"

namespace catoptric::report {

/// What a method counted, over the frames.
struct Counter {
  std::string name;
  double mean = 0.0;
  double max = 0.0;
};

/// One method's folder of a run.
struct RunData {
  std::string name;  ///< how tables call it
  std::filesystem::path folder;
  std::vector<frame::StepSample> samples;         ///< of timings.csv; empty when it is absent
  std::map<int, std::filesystem::path> frames;    ///< EXR files by number; of timings.csv alone, if
                                                  ///< there is one
  std::map<int, std::filesystem::path> previews;  ///< PNG files by frame number
  std::vector<Counter> counters;                  ///< of summary.json, by name
  std::map<std::string, std::string> stepKinds;   ///< of summary.json: what is not rendering
  std::map<int, std::string> objectNames;         ///< of summary.json: reflective objects by id
};

/// Reads a folder that holds frames/ or timings.csv. `name` empty: the folder's own name. Throws
/// UsageError when the folder is none, and with file and line when timings.csv is damaged.
RunData readRun(const std::filesystem::path& folder, const std::string& name = "");

/// Frames to compare, of any program: a run's folder; a folder of EXR files whose names end with
/// the frame's number (beauty.0012.exr, 0012.exr, img_12.exr); or one EXR file, whose frame is the
/// number at its name's end, or 1. Throws UsageError when there are none, when two files have one
/// number, when a name among several has none, or when nothing is there.
RunData readSequence(const std::filesystem::path& path);

/// Samples of the text of a timings.csv: frame,step,seconds,clock,first. Throws UsageError that
/// begins with `name` and the line.
std::vector<frame::StepSample> parseTimings(const std::string& text, const std::string& name);

}  // namespace catoptric::report
