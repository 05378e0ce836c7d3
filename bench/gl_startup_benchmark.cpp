// Time until GL is ready: library, context, first program, first pixel; each in a process of its
// own, since a second context of a process finds everything loaded. Cold: Mesa's shader cache is
// empty; warm: a process before has filled it. Goal: 0.15 s warm.
#include <benchmark/benchmark.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "core/clock.h"
#include "core/log.h"
#include "gl/context.h"
#include "gl/objects.h"
#include "gl/shader.h"

namespace catoptric::gl {
namespace {

struct Startup {
  double contextSeconds = 0;
  double programSeconds = 0;
  bool good = false;
};

// In the child process: everything up to the first pixel on the CPU.
Startup start(const char* device, const std::string& cacheFolder) {
  Startup startup;
  setenv("MESA_SHADER_CACHE_DIR", cacheFolder.c_str(), 1);
  std::int64_t begin = nowNs();
  const Context context(parseDevice(device));
  startup.contextSeconds = secondsSince(begin);
  begin = nowNs();
  Program program = Program::fullScreen("first", "gl/testdata/pattern.frag");
  const Texture color = Texture::make2D("color", GL_RGBA32F, 64, 64);
  const Framebuffer target("target", {{color}});
  target.bind();
  program.use();
  program.set("color", Vec4(0.5f));
  drawFullScreenTriangle();
  startup.good = color.read<float>(0, GL_RED, GL_FLOAT, 1)[0] == 0.5f;
  startup.programSeconds = secondsSince(begin);
  return startup;
}

Startup startInChild(const char* device, const std::string& cacheFolder) {
  int ends[2];
  if (pipe(ends) != 0) return {};
  const pid_t child = fork();
  if (child == 0) {
    Startup startup;
    try {
      startup = start(device, cacheFolder);
    } catch (const std::exception& error) {
      std::fprintf(stderr, "%s\n", error.what());
    }
    const bool written = write(ends[1], &startup, sizeof(startup)) == sizeof(startup);
    _exit(written ? 0 : 1);
  }
  close(ends[1]);
  Startup startup;
  if (child < 0 || read(ends[0], &startup, sizeof(startup)) != sizeof(startup)) startup = {};
  close(ends[0]);
  if (child > 0) waitpid(child, nullptr, 0);
  return startup;
}

void measure(benchmark::State& state, const char* device, bool warm) {
  log::setLevel(log::Level::Warning);
  std::string pattern = (std::filesystem::temp_directory_path() / "catoptric-XXXXXX").string();
  const std::filesystem::path folder = mkdtemp(pattern.data());
  if (warm) startInChild(device, folder.string());
  double context = 0;
  double program = 0;
  for (auto _ : state) {
    if (!warm) {
      std::filesystem::remove_all(folder);
      std::filesystem::create_directory(folder);
    }
    const Startup startup = startInChild(device, folder.string());
    if (!startup.good) {
      state.SkipWithError("no pixel");
      break;
    }
    state.SetIterationTime(startup.contextSeconds + startup.programSeconds);
    context += startup.contextSeconds;
    program += startup.programSeconds;
  }
  state.counters["context_s"] = benchmark::Counter(context, benchmark::Counter::kAvgIterations);
  state.counters["program_s"] = benchmark::Counter(program, benchmark::Counter::kAvgIterations);
  std::filesystem::remove_all(folder);
}

BENCHMARK_CAPTURE(measure, egl_cold, "egl:0", false)
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(measure, egl_warm, "egl:0", true)->UseManualTime()->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(measure, surfaceless_cold, "surfaceless", false)
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(measure, surfaceless_warm, "surfaceless", true)
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(measure, osmesa_cold, "osmesa", false)
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(measure, osmesa_warm, "osmesa", true)
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace catoptric::gl

BENCHMARK_MAIN();
