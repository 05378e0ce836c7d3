// The method reference with faults and costs that are put in on purpose: what
// tests/nightly_history.py gives to the nights that it simulates, and tests/builds.py measures. It
// is in a program of the tests alone (tests/CMakeLists.txt).
#include <time.h>

#include <cstdlib>
#include <limits>
#include <memory>

#include "config/options.h"
#include "core/srgb.h"
#include "methods/contract/keeps.h"
#include "methods/contract/method.h"
#include "methods/reference/reference.h"

namespace catoptric::methods {
namespace {

struct Options {
  double slower = 0.0;
  int object = 0;
  int steps = 0;
  int nan = 0;
  int crash = 0;
  int refused = 0;
  int buildMs = 0;
  int againMs = 0;
  int frameMs = 0;
};

const config::OptionTable<Options>& optionTable() {
  using config::field, config::range;
  static const config::OptionTable<Options> table(
      "faulty", "Faults of the tests' method faulty.",
      {field(&Options::slower, "slower", range(0, 100), "percent by which each frame takes longer"),
       field(&Options::object, "object", range(0, 1000), "id of the object that is lighter"),
       field(&Options::steps, "steps", range(0, 255), "display steps by which it is lighter"),
       field(&Options::nan, "nan", range(0, 1000), "frame with a NaN; 0: none"),
       field(&Options::crash, "crash", range(0, 1000), "frame that ends the program; 0: none"),
       field(&Options::refused, "refused", range(0, 1000), "added to the counter `refused`"),
       field(&Options::buildMs, "build_ms", range(0, 9999), "CPU time of prepare()"),
       field(&Options::againMs, "again_ms", range(0, 9999),
             "CPU time of a frame that was not preceded by one beside it"),
       field(&Options::frameMs, "frame_ms", range(0, 9999), "CPU time of every frame")});
  return table;
}

/// CPU time: what waits for a processor is not longer for a fault.
double cpuSeconds(clockid_t clock = CLOCK_PROCESS_CPUTIME_ID) {
  timespec now{};
  clock_gettime(clock, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// CPU time of this thread, so that the wall's clock takes as long at least.
void spend(double seconds) {
  const double until = cpuSeconds(CLOCK_THREAD_CPUTIME_ID) + seconds;
  while (cpuSeconds(CLOCK_THREAD_CPUTIME_ID) < until) {
  }
}

/// Makes an object lighter by some steps of the display.
void lighten(image::Image& image, int object, int steps) {
  const int id = image.channel("id.object");
  for (std::size_t pixel = 0; pixel < image.pixelCount(); ++pixel) {
    float* values = &image.data[pixel * image.channels.size()];
    if (id < 0 || static_cast<int>(values[id]) != object) continue;
    for (int c = 0; c < 3; ++c)
      values[c] = static_cast<float>(linearFromSrgb(srgbFromLinear(values[c]) + steps / 255.0));
  }
}

class Faulty : public Method, public KeepsFrames {
 public:
  explicit Faulty(const Options& options)
      : options_(options),
        reference_(referenceEntry().make(
            config::parseText(R"({"samples": 2, "rays": 1})", "options of faulty"))) {}

  MethodPlan plan(const scene::Scene& scene, const RunSettings& settings) const override {
    return reference_->plan(scene, settings);
  }
  void prepare(Services& services, const RunSettings& settings) override {
    reference_->prepare(services, settings);
    spend(1e-3 * options_.buildMs);
  }
  std::string keeps() const override { return options_.againMs > 0 ? "what costs again_ms" : ""; }

  void render(const FrameInput& input, Services& services, FrameOutput& output) override {
    const int number = input.frame.number;
    if (number == options_.crash) std::abort();
    const double start = cpuSeconds();
    reference_->render(input, services, output);
    const bool follows = !input.firstOfSequence && std::abs(number - last_) == 1;
    last_ = number;
    services.timer.measure("trace", [&] {
      spend((cpuSeconds() - start) * options_.slower / 100.0 +
            1e-3 * (options_.frameMs + (follows ? 0 : options_.againMs)));
    });
    lighten(*output.image, options_.object, options_.steps);
    if (number == options_.nan) output.image->data[0] = std::numeric_limits<float>::quiet_NaN();
    output.counters["refused"] += static_cast<std::uint64_t>(options_.refused);
  }

 private:
  Options options_;
  int last_ = 0;  ///< the frame before
  std::unique_ptr<Method> reference_;
};

}  // namespace

const MethodEntry& faultyEntry();
const MethodEntry& faultyEntry() {
  static const MethodEntry entry{
      .id = "faulty",
      .summary = "the tests' reference, with faults that are put in on purpose",
      .paper = "",
      .steps = referenceEntry().steps,
      .counters = referenceEntry().counters,
      .options = optionTable().schema(),
      .make = [](const config::Value& options) -> std::unique_ptr<Method> {
        return std::make_unique<Faulty>(optionTable().parse(options));
      }};
  return entry;
}

}  // namespace catoptric::methods
