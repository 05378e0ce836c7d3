// A lab for tests: simulated programs with known faults on a simulated machine that is shared with
// others. Times, verdicts and history come from the real code.
#pragma once

#include <filesystem>
#include <fstream>
#include <map>
#include <random>
#include <set>
#include <string>

#include "core/error.h"
#include "core/file.h"
#include "core/hash.h"
#include "nightly/judge_night.h"
#include "nightly/lab.h"
#include "nightly/night.h"
#include "run/folder/records.h"

namespace catoptric::nightly {

inline const std::vector<int> kTestFrames = {1, 2, 3, 4, 5, 6, 7, 8};

/// Simulates drift, another program that comes and goes, and single disturbed frames, as in
/// engine_test.cpp.
struct Machine {
  double render(double cost) {
    std::normal_distribution<double> small(0.0, 0.02);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    if (clock > nextChange) {
      busy = !busy;
      nextChange = clock + (busy ? 3.0 : 9.0) * -std::log(1.0 - unit(random));
    }
    double seconds =
        cost * (1.0 + 0.17 * std::sin(clock / 40.0)) * (busy ? 1.6 : 1.0) * std::exp(small(random));
    if (unit(random) < 0.08) seconds *= 1.0 + unit(random);
    clock += seconds;
    return seconds;
  }
  std::mt19937 random{1};
  double clock = 0.0;
  double nextChange = 5.0;
  bool busy = false;
};

/// The faults of a build, by scene.
struct Build {
  std::map<std::string, double> cost;  ///< factor on the time; 1 for scenes that are not listed
  std::map<std::string, double> startCost;
  std::map<std::string, int> steps;  ///< display steps by which a reflector differs
  std::map<std::string, int> pops;   ///< the same, in addition, in every other frame
  std::map<std::string, std::map<std::string, std::uint64_t>> counters;
  std::map<std::string, std::uint64_t> memory;  ///< in MiB
  std::set<std::string> nan;
  std::set<std::string> crash;
};

class TestLab : public Lab {
 public:
  explicit TestLab(std::map<std::string, Build>& builds) : builds_(builds) {}

  std::vector<std::string> methods(const NightScene&) override { return {"m"}; }

  BenchFacts bench(const NightCase& one) override {
    BenchFacts facts;
    facts.frames = kTestFrames;
    facts.description = "scene " + one.scene.name + edits[one.scene.name] + "\n";
    for (const auto& [name, value] : one.scene.settings)
      facts.description += "set:" + name + " " + value + "\n";
    Fingerprint print;
    print.add(facts.description);
    facts.print = print.text();
    facts.description += "object 7 ball\nobject 8 floor\n";
    facts.command = "catoptric render " + one.scene.name;
    return facts;
  }

  Turns measure(const NightCase& one, const std::vector<Program>& programs, int rounds, bool,
                const std::filesystem::path& writeTo) override {
    std::vector<Rendering> renderings;
    renderings.reserve(programs.size());
    std::vector<study::Runner*> runners;
    Turns turns;
    study::TurnOptions how;
    how.repeats = rounds;
    how.seed = ++measurements_;
    for (const Program& program : programs) {
      renderings.emplace_back(*this, buildOf(program.file), one.scene.name);
      runners.push_back(&renderings.back());
      std::filesystem::path& frames = turns.frames[program.role];
      if (!writeTo.empty() && program.role == role::kTonight) frames = writeTo;
      if (!writeTo.empty() && program.role == role::kNamed) frames = writeTo.string() + ".named";
      how.writeTo.push_back(frames);
    }
    const study::Measurement measured = study::measureInTurns(runners, kTestFrames, how);
    for (std::size_t i = 0; i < programs.size(); ++i) {
      const std::string& name = programs[i].role;
      turns.memory[name] = renderings[i].memoryBytes();
      for (const std::string& step : measured.steps(i))
        turns.steps[name][step] = measured.stepTimes(i, step);
      if (measured.settings[i].failure.empty())
        turns.times[name] = measured.times(i);
      else
        turns.failures[name] = measured.settings[i].failure;
      if (name == role::kTonight) turns.written = measured.settings[i].written;
    }
    return turns;
  }

  std::map<std::string, StepTimes> starts(const NightCase& one,
                                          const std::vector<Program>& programs,
                                          int rounds) override {
    std::map<std::string, StepTimes> times;
    for (int round = 0; round < rounds; ++round)
      for (const Program& program : programs) {
        const auto& cost = builds_[buildOf(program.file)].startCost;
        const auto own = cost.find(one.scene.name);
        const double seconds = machine.render(own == cost.end() ? 1.0 : own->second);
        times[program.role]["start"].push_back({seconds});
        times[program.role]["start.bake"].push_back({0.5 * seconds});
      }
    return times;
  }

  void truth(const NightCase& one, const std::vector<int>& frames,
             const std::filesystem::path& folder) override {
    const Rendering exact(*this, "exact", one.scene.name);
    for (const int frame : frames) exact.write(frame, folder);
  }

  Machine machine;
  std::map<std::string, std::string> edits;  ///< of scenes' files

 private:
  /// The name of a build: b07 for the program "builds/b07/bin/catoptric" or a file "b07".
  static std::string buildOf(const std::filesystem::path& program) {
    return program.filename() == "catoptric"
               ? program.parent_path().parent_path().filename().string()
               : program.filename().string();
  }

  class Rendering : public study::Runner {
   public:
    Rendering(TestLab& lab, const std::string& build, std::string scene)
        : lab_(lab), build_(lab.builds_[build]), scene_(std::move(scene)) {}

    study::FrameReport render(int frame, const std::filesystem::path& writeTo) override {
      if (build_.crash.contains(scene_)) throw Error(ExitCode::FramesFailed, "killed by signal 11");
      study::FrameReport report;
      const auto cost = build_.cost.find(scene_);
      report.seconds = lab_.machine.render((cost == build_.cost.end() ? 1.0 : cost->second) *
                                           (0.1 + 0.02 * (frame % 3)));
      report.cpuSeconds = report.seconds;
      report.steps = {{"reflect", 0.7 * report.seconds}, {"scene", 0.3 * report.seconds}};
      report.counters = {{"rays", 1000}, {"refused", 0}};
      if (build_.counters.contains(scene_))
        for (const auto& [name, count] : build_.counters.at(scene_)) report.counters[name] = count;
      if (!writeTo.empty()) report.pixels = write(frame, writeTo);
      return report;
    }

    std::uint64_t memoryBytes() const {
      const auto own = build_.memory.find(scene_);
      return (own == build_.memory.end() ? 100ull : own->second) << 20;
    }

    std::string write(int frame, const std::filesystem::path& folder) const {
      const bool bad = build_.nan.contains(scene_) && frame == 2;
      const auto stepsOf = [&](const std::map<std::string, int>& scenes) {
        const auto found = scenes.find(scene_);
        return found == scenes.end() ? 0 : found->second;
      };
      const int steps = stepsOf(build_.steps) + (frame % 2 == 0 ? stepsOf(build_.pops) : 0);
      const std::string text =
          scene_ + std::to_string(frame) + (bad ? "nan" : "") + std::to_string(steps);
      Fingerprint print;
      print.add(text);
      std::string& bytes = lab_.frames_[text];
      if (bytes.empty()) bytes = encoded(frame, bad, steps);
      const std::filesystem::path file = folder / run::framePath("frames", frame, ".exr");
      std::filesystem::create_directories(file.parent_path());
      std::ofstream(file) << bytes;
      return print.text();
    }

   private:
    /// A frame with a floor and a ball; the ball is lighter by `steps` display steps.
    static std::string encoded(int frame, bool bad, int steps) {
      image::Image picture{32, 32, {"R", "G", "B", "id.object", "mask.reflective"}, {}};
      for (int y = 0; y < 32; ++y)
        for (int x = 0; x < 32; ++x) {
          const bool ball = (x - 16) * (x - 16) + (y - 16) * (y - 16) < 40;
          const float value = 0.2f + 0.01f * static_cast<float>((x + y + frame) % 8) +
                              (ball ? 0.0045f * static_cast<float>(steps) : 0.0f);
          const float red = bad && ball && x == 16 ? std::nanf("") : value;
          picture.data.insert(picture.data.end(), {red, value, value, ball ? 7.0f : 8.0f, 1.0f});
        }
      image::ExrOptions options;
      options.halfBeauty = false;
      const std::vector<std::byte> bytes = image::encodeExr(picture, options);
      return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
    }

    TestLab& lab_;
    const Build& build_;
    std::string scene_;
  };

  std::map<std::string, Build>& builds_;
  /// Encoded frames, indexed by a text that describes their contents.
  std::map<std::string, std::string> frames_;
  std::uint64_t measurements_ = 0;
};

}  // namespace catoptric::nightly
