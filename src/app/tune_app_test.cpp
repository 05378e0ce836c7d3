// The command tune, as a program.
#include <gmock/gmock.h>

#include <chrono>

#include "app/test_program.h"

namespace catoptric::app {
namespace {

using testing::HasSubstr;

class Tune : public Study {};

TEST_F(Tune, FindsTheFastestWithinAnError) {
  // Only 4 samples give the truth's pixels.
  const Result result =
      run("tune run.json --method reference --against truth --max-error 'L1_8bit<=0 every-frame' "
          "--vary methods.reference.samples=1,2,4 --repeats 1 --progress none --out t "
          "--test-path path.json");
  EXPECT_EQ(result.exitCode, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("reference samples=4"));
  EXPECT_THAT(result.out, HasSubstr("holds on all frames"));
  EXPECT_THAT(result.out, HasSubstr("On path.json: L1_8bit 0.000"));
  const Result tuned = run("render t/tuned.json --out tuned --frames 1 -q");
  EXPECT_EQ(tuned.exitCode, 0) << tuned.err;
  EXPECT_THAT(textOf(folder / "tuned/summary.json"), HasSubstr("\"samples\": 4"));
}

TEST_F(Tune, SaysHowManyTimesThatOfTracedItTakes) {
  const Result result = run(
      R"(tune run.json --set 'methods=[{"method": "reference", "max_standard_error": 0, "name": "fast", "samples": 1}, )"
      R"({"method": "reference", "max_standard_error": 0, "name": "traced", "samples": 64}]' --set errors.against=[] )"
      "--method fast,traced --against traced --max-error 'L1_8bit<=255' --vary none --frames 1 "
      "--repeats 8 --progress none --out t");
  EXPECT_EQ(result.exitCode, 0) << result.err;
  EXPECT_THAT(result.out,
              testing::ContainsRegex("^fast: [0-9.]+ ms .steady frame., 0[.][0-9]+ .0[.][0-9]+ to "
                                     "0[.][0-9]+. times that of traced; L1_8bit"));
}

TEST_F(Tune, VariesWhatTradesAccuracyForTime) {
  const Result result =
      run("tune run.json --method environment_map --against truth --max-error 'L1_8bit<=255' "
          "--repeats 1 --progress none --out t");
  EXPECT_EQ(result.exitCode, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("environment_map proxy="));
  EXPECT_THAT(result.out, HasSubstr("of 6 combinations"));
  const Result none =
      run("tune run.json --method environment_map --against truth --max-error 'L1_8bit<=255' "
          "--vary none --repeats 1 --progress none --out u");
  EXPECT_THAT(none.out, HasSubstr("of 1 combinations"));
}

TEST_F(Tune, FindsTheMostAccurateWithinATime) {
  const Result result =
      run("tune run.json --method reference --against truth --max-time 10s --repeats 8 "
          "--vary methods.reference.samples=1,2,3 --frames 1 --progress none --out t");
  EXPECT_EQ(result.exitCode, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("reference samples=3"));
  const Result share =
      run("tune run.json --method reference --against truth --max-time 50x:truth --repeats 8 "
          "--vary methods.reference.samples=1,2,3 --frames 1 --progress none --out u");
  EXPECT_EQ(share.exitCode, 0) << share.err;
  EXPECT_THAT(share.out, HasSubstr("reference samples=3"));
}

TEST_F(Tune, NamesTheNearestWhereNothingSatisfies) {
  const Result result =
      run("tune run.json --method reference --against truth --max-error 'L1_8bit<=0' "
          "--vary methods.reference.samples=1,2,3 --repeats 1 --progress none --out t");
  EXPECT_EQ(result.exitCode, 7) << result.err;
  EXPECT_THAT(result.out, HasSubstr("Nearest: reference samples=3"));
  EXPECT_THAT(result.out, HasSubstr("Of this error, reflective pixels hold "));
  EXPECT_THAT(result.out, HasSubstr("The bound cannot be met: bound L1_8bit_reflective instead"));
  EXPECT_FALSE(fs::exists(folder / "t/tuned.json"));
}

TEST_F(Tune, KeepsItsBudgetAndNamesTheNearest) {
  // Hours, without a budget; one frame takes milliseconds
  const auto start = std::chrono::steady_clock::now();
  const Result result =
      run("tune run.json --method reference --against truth --max-error 'L1_8bit<=0' "
          "--set path=path.json --set frames=1-3 --vary methods.reference.samples=1..24:24 "
          "--vary methods.reference.rays=1..24:24 --repeats 1000 --budget 0.05 "
          "--progress none --out t");
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  EXPECT_EQ(result.exitCode, 7) << result.err;
  EXPECT_THAT(result.out, HasSubstr("The budget was spent"));
  EXPECT_THAT(result.out, HasSubstr("Nearest: reference samples="));
  EXPECT_GT(seconds.count(), 3.0);
  EXPECT_LT(seconds.count(), 3.0 * 2.0);  // of a machine that does other things, too
}

TEST_F(Tune, SaysBeforeWhatItWillDo) {
  const Result result =
      run("tune run.json --method reference --against truth --max-error 'L1_8bit<=1' "
          "--vary methods.reference.samples=1,2,3 --vary methods.reference.rays=1,2 --repeats 4 "
          "--dry-run --out t");
  EXPECT_EQ(result.exitCode, 0) << result.err;
  // The middle, two other numbers of samples, one of rays: one round of errors, one warm, four
  EXPECT_THAT(result.out, HasSubstr("6 combinations. First, 4 that differ in one option are "
                                    "measured on 3 of 3 frames: 72 frames to render"));
  EXPECT_FALSE(fs::exists(folder / "t"));
}

TEST_F(Tune, RefusesWhatContradictsItself) {
  const std::map<std::string, std::string> wrong{
      {"", "give a bound"},
      {"--max-error 'L1_8bit<=1' --max-time 1s", "cannot be combined"},
      {"--max-error 'L1<=1'", "is not an error measure"},
      {"--max-error 'L1_8bit<=1' --vary image.width=8,16", "varies options of methods"},
      {"--max-error 'L1_8bit<=1' --verify most", "must be all, or a number"},
      {"--max-error 'L1_8bit<=1 every-frame' --per-reflector", "a bound on the mean error"},
      {"--max-time 0.8x:trut", "did you mean \"truth\"?"},
      {"--max-time 1s --repeats 2", "needs --repeats 8 or more"},
  };
  for (const auto& [options, hint] : wrong) {
    const Result result =
        run("tune run.json --method reference --against truth --out t " + options);
    EXPECT_EQ(result.exitCode, 2) << options << "\n" << result.err;
    EXPECT_THAT(result.err, HasSubstr(hint)) << options;
  }
  const Result first =
      run("tune run.json --method reference --against truth --max-error 'flicker<=1' --frames 1 "
          "--repeats 1 --vary none --progress none --out u");
  EXPECT_EQ(first.exitCode, 2) << first.out;
  EXPECT_THAT(first.err, HasSubstr("no frame has flicker: it needs a frame before it"));
}

}  // namespace
}  // namespace catoptric::app
