// Reads the data of a run's folder that reports need: frames, previews and step times.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "frame/steps.h"

namespace catoptric::report {

/// A counter of a method, summarized over the frames.
struct Counter {
  std::string name;
  double mean = 0.0;
  double max = 0.0;
};

/// The folder of one method of a run.
struct RunData {
  std::string name;  ///< the name in tables
  std::filesystem::path folder;
  std::vector<frame::StepSample> samples;  ///< from timings.csv; empty if it is absent
  std::map<int, std::filesystem::path>
      frames;  ///< EXR files by frame number; if there is a timings.csv, only the frames in it
  std::map<int, std::filesystem::path> previews;  ///< PNG files by frame number
  std::vector<Counter> counters;                  ///< from summary.json, by name
  std::map<std::string, std::string>
      stepKinds;                           ///< from summary.json: the steps that are not rendering
  std::string keeps;                       ///< from summary.json: methods::keepsOf()
  int pathFrames = 1;                      ///< from summary.json: frames of the camera path
  std::map<int, std::string> objectNames;  ///< from summary.json: reflective objects by id
};

/// Reads a folder that contains frames/ or timings.csv. `name` empty: the folder's name is used.
/// Throws UsageError if the folder is not a run, or, with file and line, if timings.csv is damaged.
RunData readRun(const std::filesystem::path& folder, const std::string& name = "");

/// Reads frames of any program for a comparison. `path` is a run's folder; a folder of EXR files
/// whose names end with the frame's number (beauty.0012.exr, 0012.exr, img_12.exr); or one EXR
/// file, whose frame number is at the end of its name, otherwise 1. Throws UsageError if there are
/// no frames, if two files have the same number, if one of several files has no number, or if
/// `path` does not exist.
RunData readSequence(const std::filesystem::path& path);

/// Parses the text of a timings.csv: frame,step,seconds,clock,first. Throws UsageError, which
/// begins with `name` and the line.
std::vector<frame::StepSample> parseTimings(const std::string& text, const std::string& name);

}  // namespace catoptric::report
